//! A virtual stage: the devices' side of the conversation.

use core::time::Duration;

use crate::zaber::{Flag, Header, HostCommand, HostCommandDecoder, Message};

/// `maxspeed` in microsteps per second.
const SPEED_SCALE: f64 = 1.6384;

/// Two devices, the first with two axes.
pub(super) struct Fake {
    ear: HostCommandDecoder,
    pub(super) axes: Vec<FakeAxis>,
    pub(super) checksums: bool,
    /// Microsteps a full step.
    pub(super) resolution: u32,
    /// Replies that will be lost.
    pub(super) lost_replies: usize,
    /// Nothing is heard or said.
    pub(super) is_dead: bool,
    /// It says that it stops, but goes on until `estop`.
    pub(super) glides: bool,
    /// Commands that begin like this are rejected with that word.
    pub(super) rejects: Option<(&'static str, &'static str)>,
    /// Commands that begin like this are not heard.
    pub(super) deaf_to: Option<&'static str>,
}

pub(super) struct FakeAxis {
    device: u8,
    number: u8,
    pub(super) position: f64,
    pub(super) target: f64,
    pub(super) maxspeed: f64,
    pub(super) accel: f64,
    pub(super) warnings: Vec<Flag>,
    /// It stalls when it gets here.
    pub(super) stalls_at: Option<f64>,
    /// It says that it stands when it gets here.
    pub(super) stops_short_at: Option<f64>,
    is_homing: bool,
    /// Homing ends with this fault.
    pub(super) homing_fault: Option<Flag>,
    moved: Duration,
}

impl Fake {
    pub(super) fn new() -> Self {
        let axis = |device, number| FakeAxis {
            device,
            number,
            position: 10_000.0,
            target: 10_000.0,
            maxspeed: 20_000.0 * SPEED_SCALE,
            accel: 100.0,
            warnings: vec![Flag::NO_REFERENCE],
            stalls_at: None,
            stops_short_at: None,
            is_homing: false,
            homing_fault: None,
            moved: Duration::ZERO,
        };
        Self {
            ear: HostCommandDecoder::default(),
            axes: vec![axis(1, 1), axis(1, 2), axis(2, 1)],
            checksums: false,
            resolution: 64,
            lost_replies: 0,
            is_dead: false,
            glides: false,
            rejects: None,
            deaf_to: None,
        }
    }

    /// The power goes and comes: what moved stands, and knows its place no more.
    pub(super) fn reboot(&mut self, now: Duration, device: u8) {
        for axis in self.axes.iter_mut().filter(|axis| axis.device == device) {
            axis.go(now);
            axis.position = 0.0;
            axis.target = 0.0;
            axis.warnings = vec![Flag::NO_REFERENCE];
        }
    }

    /// Takes what arrives, and gives the replies.
    pub(super) fn hear(&mut self, now: Duration, bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut commands = Vec::new();
        self.ear.push(bytes, |command| commands.push(command));
        commands.into_iter().flat_map(|command| self.obey(now, &command)).collect()
    }

    fn obey(&mut self, now: Duration, command: &HostCommand) -> Vec<Vec<u8>> {
        self.axes.iter_mut().for_each(|axis| axis.go(now));
        if self.is_dead || self.deaf_to.is_some_and(|start| command.text.starts_with(start)) {
            return Vec::new();
        }
        let mut devices: Vec<u8> = self.axes.iter().map(|axis| axis.device).collect();
        devices.dedup();
        devices.retain(|device| command.device == 0 || *device == command.device);
        let replies: Vec<Vec<u8>> =
            devices.into_iter().map(|device| self.reply(device, command).encode(self.checksums)).collect();
        let lost = self.lost_replies.min(replies.len());
        self.lost_replies -= lost;
        replies.into_iter().skip(lost).collect()
    }

    fn reply(&mut self, device: u8, command: &HostCommand) -> Message {
        let rejection = self
            .rejects
            .filter(|(start, _)| command.text.starts_with(start))
            .map(|(_, word)| word.to_owned());
        let axis_count = self.axes.iter().filter(|axis| axis.device == device).count();
        let mut result = rejection.map_or(Ok("0".to_owned()), Err);
        let is_meant = |axis: &&mut FakeAxis| {
            axis.device == device && (command.axis == 0 || axis.number == command.axis)
        };
        if result.is_ok() {
            if command.text == "stop" && self.glides {
                // Nothing happens.
            } else if command.text == "set comm.checksum 1" {
                self.checksums = true;
            } else if command.text == "get version" {
                result = Ok("7.38".to_owned());
            } else if command.text == "get system.axiscount" {
                result = Ok(axis_count.to_string());
            } else if command.text == "get resolution" {
                result = Ok(self.resolution.to_string());
            } else {
                for axis in self.axes.iter_mut().filter(is_meant) {
                    result = axis.obey(&command.text);
                }
            }
        }
        let axes = || {
            self.axes
                .iter()
                .filter(|axis| axis.device == device)
                .filter(|axis| command.axis == 0 || axis.number == command.axis)
        };
        Message::Reply {
            header: Header { device, axis: command.axis, id: command.id },
            accepted: result.is_ok(),
            busy: axes().any(FakeAxis::is_busy),
            flag: axes().find_map(|axis| axis.warnings.first().copied()).unwrap_or(Flag::NONE),
            data: result.unwrap_or_else(|word| word),
        }
    }
}

impl FakeAxis {
    pub(super) fn is_busy(&self) -> bool {
        (self.position - self.target).abs() > 0.0
    }

    fn obey(&mut self, text: &str) -> Result<String, String> {
        let words: Vec<&str> = text.split(' ').collect();
        let number = |word: &str| word.parse::<f64>().map_err(|_| "BADDATA".to_owned());
        match words[..] {
            ["get", "pos"] => return Ok(format!("{:.0}", self.position)),
            ["get", "limit.min"] => return Ok("0".to_owned()),
            ["get", "limit.max"] => return Ok("100000".to_owned()),
            ["warnings"] => {
                let flags: Vec<String> = self.warnings.iter().map(Flag::to_string).collect();
                return Ok(format!("{:02} {}", flags.len(), flags.join(" ")));
            }
            ["warnings", "clear"] => self.warnings.retain(|flag| *flag == Flag::NO_REFERENCE),
            ["driver", "enable"] => {}
            ["set", "maxspeed", value] => self.maxspeed = number(value)?,
            ["set", "accel", value] => self.accel = number(value)?,
            ["move", "abs", target] => {
                self.set_out(number(target)?);
            }
            ["home"] => {
                self.set_out(0.0);
                self.is_homing = true;
            }
            ["stop" | "estop"] => {
                if self.is_busy() {
                    self.warnings.push(Flag::INTERRUPTED);
                }
                self.target = self.position;
                self.is_homing = false;
            }
            _ => return Err("BADCOMMAND".to_owned()),
        }
        Ok("0".to_owned())
    }

    fn set_out(&mut self, target: f64) {
        self.warnings.retain(|flag| !matches!(*flag, Flag::INTERRUPTED | Flag::MANUAL_CONTROL));
        self.target = target;
    }

    /// Moves until now.
    fn go(&mut self, now: Duration) {
        let way = self.maxspeed / SPEED_SCALE * now.saturating_sub(self.moved).as_secs_f64();
        self.moved = now;
        if !self.is_busy() {
            return;
        }
        let left = self.target - self.position;
        let next = if left.abs() <= way { self.target } else { self.position + way.copysign(left) };
        let passes = |place: f64| (self.position.min(next)..=self.position.max(next)).contains(&place);
        if let Some(place) = self.stalls_at.filter(|place| passes(*place)) {
            (self.position, self.target) = (place, place);
            self.warnings.insert(0, Flag::STALLED);
        } else if let Some(place) = self.stops_short_at.filter(|place| passes(*place)) {
            (self.position, self.target) = (place, place);
        } else {
            self.position = next;
        }
        if self.is_homing && !self.is_busy() {
            self.is_homing = false;
            match self.homing_fault {
                Some(flag) => self.warnings.insert(0, flag),
                None => self.warnings.retain(|flag| *flag != Flag::NO_REFERENCE),
            }
        }
    }
}
