//! One axis: its settings, its motion and its faults.

use std::time::Duration;

use tactus_schema::rig::SimulatedStage;
use tactus_wire::stage::AxisName;
use tactus_wire::zaber::{Axis, Flag, Rejection, Severity, accel_setting, accel_told, speed_told};
use tokio::time::Instant;

use crate::world::{World, on_axis};

/// Microsteps per full step, unless the rig file gives them.
const RESOLUTION: u32 = 64;

/// Homing that finds no sensor gives up after this.
const HOMING_GIVES_UP: Duration = Duration::from_secs(5);

/// `FE`: the limit sensor cannot be reached.
const LIMIT_ERROR: &str = "FE";

/// An axis of a virtual Zaber device.
#[derive(Debug)]
pub(super) struct VirtualAxis {
    name: AxisName,
    /// Index of the world's axis that it moves: 0 is x.
    index: usize,
    axis: Axis,
    stage: SimulatedStage,
    maxspeed: i64,
    accel: i64,
    flags: Vec<Flag>,
    homing: Option<Homing>,
    /// The next homing finds no sensor.
    fails_homing: bool,
    /// When it hits the end of its travel.
    limit_at: Option<Instant>,
}

/// How the present homing will end.
#[derive(Debug, Clone, Copy)]
enum Homing {
    Found,
    GivesUp(Instant),
}

impl VirtualAxis {
    pub(super) fn new(name: AxisName, axis: Axis, stage: SimulatedStage) -> Self {
        let microsteps_per_mm = 1000.0 / axis.um_per_microstep;
        let speed = axis.speed_setting(stage.speed_max_mm_per_s);
        let accel = accel_setting(stage.acceleration_mm_per_s2 * microsteps_per_mm);
        Self {
            name,
            index: name.of([0, 1, 2]),
            axis,
            stage,
            // 0 means no limit: as fast as it can.
            maxspeed: speed.unwrap_or(0),
            accel: accel.unwrap_or(0),
            flags: Vec::new(),
            homing: None,
            fails_homing: false,
            limit_at: None,
        }
    }

    pub(super) fn name(&self) -> AxisName {
        self.name
    }

    pub(super) fn device(&self) -> u8 {
        self.axis.device
    }

    pub(super) fn number(&self) -> u8 {
        self.axis.number
    }

    /// The most serious flag.
    pub(super) fn flag(&self) -> Flag {
        self.flags.iter().copied().fold(Flag::NONE, graver)
    }

    pub(super) fn limit_at(&self) -> Option<Instant> {
        self.limit_at
    }

    pub(super) fn is_busy(&self, world: &mut World) -> bool {
        self.homing.is_some() || world.motion_of(self.index).is_moving()
    }

    pub(super) fn next_wake(&self, world: &mut World) -> Option<Instant> {
        let gives_up = if let Some(Homing::GivesUp(at)) = self.homing { Some(at) } else { None };
        [gives_up, self.limit_at, world.motion_of(self.index).next_end()].into_iter().flatten().min()
    }

    /// Restarts as after a power failure: at rest, and believes that it is at its 0.
    pub(super) fn power_up(&mut self, world: &mut World, now: Instant) {
        self.flags = vec![Flag::NO_REFERENCE];
        (self.homing, self.limit_at) = (None, None);
        let believed_mm = on_axis(self.index, self.axis.position_mm(0));
        let motion = world.motion_of(self.index);
        motion.freeze(now);
        motion.believe(believed_mm);
    }

    /// Stalls if it has hit the end of its travel.
    pub(super) fn run_into_limit(&mut self, world: &mut World, now: Instant) {
        if let Some(at) = self.limit_at.filter(|at| *at <= now) {
            self.stall(world, at);
        }
    }

    /// Stops at once with a fault.
    pub(super) fn stall(&mut self, world: &mut World, at: Instant) {
        world.settle(at);
        world.motion_of(self.index).freeze(at);
        (self.homing, self.limit_at) = (None, None);
        self.raise(Flag::STALLED);
    }

    /// Handles the end of a motion.
    pub(super) fn settle(&mut self, world: &mut World, now: Instant) {
        if world.motion_of(self.index).is_moving() {
            return;
        }
        self.limit_at = None;
        match self.homing {
            Some(Homing::Found) => {
                let home_mm = on_axis(self.index, self.home_mm());
                world.motion_of(self.index).believe(home_mm);
                self.flags.retain(|flag| *flag != Flag::NO_REFERENCE);
                self.homing = None;
            }
            Some(Homing::GivesUp(at)) if at <= now => {
                self.homing = None;
                self.flags.extend(Flag::parse(LIMIT_ERROR));
            }
            Some(Homing::GivesUp(_)) | None => {}
        }
    }

    pub(super) fn lose_steps(&self, world: &mut World, lost_mm: f64) {
        world.motion_of(self.index).lose_steps(lost_mm);
    }

    pub(super) fn fail_homing(&mut self, fails: bool) {
        self.fails_homing = fails;
    }

    /// Executes a command. With `stays` it accepts a move but does not make it.
    pub(super) fn obey(
        &mut self,
        world: &mut World,
        words: &[&str],
        lie_mm: f64,
        stays: bool,
        now: Instant,
    ) -> Result<String, Rejection> {
        let done = Ok("0".to_owned());
        match *words {
            [] | ["driver", "enable"] => done,
            ["get", setting] => self.get(world, setting, lie_mm, now).map(|value| value.to_string()),
            ["set", "maxspeed", value] => {
                self.maxspeed = number(value, 0)?;
                done
            }
            ["set", "accel", value] => {
                self.accel = number(value, 0)?;
                done
            }
            ["move", "abs", target] => {
                let target = number(target, i64::from(i32::MIN))?;
                let [least, greatest] = self.limits();
                if !(least..=greatest).contains(&target) {
                    return Err(Rejection::BadData);
                }
                if !stays {
                    self.set_out(world, target, now);
                }
                done
            }
            ["home"] => {
                self.go_home(world, now);
                done
            }
            ["stop"] => {
                self.interrupt(world);
                let motion = world.motion_of(self.index);
                motion.hold(now);
                motion.forget_held();
                self.watch_limit(world);
                done
            }
            ["estop"] => {
                self.interrupt(world);
                world.motion_of(self.index).freeze(now);
                done
            }
            ["warnings"] => Ok(self.list()),
            ["warnings", "clear"] => {
                self.flags.retain(|flag| flag.severity() == Severity::Suspect);
                done
            }
            _ => Err(Rejection::BadCommand),
        }
    }

    fn get(&self, world: &World, setting: &str, lie_mm: f64, now: Instant) -> Result<i64, Rejection> {
        let [least, greatest] = self.limits();
        match setting {
            "pos" => {
                let believed_mm = world.believed_mm(now)[self.index] + lie_mm;
                self.axis.microsteps(believed_mm).ok_or(Rejection::BadData)
            }
            "limit.min" => Ok(least),
            "limit.max" => Ok(greatest),
            "maxspeed" => Ok(self.maxspeed),
            "accel" => Ok(self.accel),
            "resolution" => Ok(self.axis.resolution.unwrap_or(RESOLUTION).into()),
            _ => Err(Rejection::BadCommand),
        }
    }

    fn set_out(&mut self, world: &mut World, target: i64, now: Instant) {
        self.flags.retain(|flag| !matches!(*flag, Flag::INTERRUPTED | Flag::MANUAL_CONTROL));
        self.interrupt(world);
        let target_mm = on_axis(self.index, self.axis.position_mm(target));
        let (speed_mm_per_s, acceleration) = (self.speed_mm_per_s(), self.acceleration_mm_per_s2());
        let motion = world.motion_of(self.index);
        motion.hold(now);
        motion.forget_held();
        motion.set_acceleration(acceleration);
        motion.push(target_mm, speed_mm_per_s, now);
        self.watch_limit(world);
    }

    fn go_home(&mut self, world: &mut World, now: Instant) {
        self.flags.retain(|flag| !matches!(*flag, Flag::INTERRUPTED | Flag::MANUAL_CONTROL));
        self.interrupt(world);
        self.limit_at = None;
        let home_mm = on_axis(self.index, self.home_mm());
        let speed_mm_per_s = self.speed_mm_per_s();
        let motion = world.motion_of(self.index);
        motion.hold(now);
        motion.forget_held();
        if std::mem::take(&mut self.fails_homing) {
            self.homing = Some(Homing::GivesUp(now + HOMING_GIVES_UP));
            return;
        }
        // Homing ends at the true position of the sensor, and cancels an armed loss of steps.
        motion.lose_steps(0.0);
        motion.push_true(home_mm, speed_mm_per_s, now);
        self.homing = Some(Homing::Found);
    }

    /// Another command replaces the present one.
    fn interrupt(&mut self, world: &mut World) {
        if self.is_busy(world) {
            self.raise(Flag::INTERRUPTED);
        }
        self.homing = None;
    }

    fn raise(&mut self, flag: Flag) {
        if !self.flags.contains(&flag) {
            self.flags.push(flag);
        }
    }

    fn watch_limit(&mut self, world: &mut World) {
        let mut travel_mm = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
        travel_mm[self.index] = self.stage.travel_mm[self.index];
        self.limit_at = world.motion_of(self.index).leaves(travel_mm);
    }

    /// The number of flags, then the flags, the most serious first.
    fn list(&self) -> String {
        let mut flags = self.flags.clone();
        flags.sort_by_key(|flag| std::cmp::Reverse(gravity(*flag)));
        let words = flags.iter().map(Flag::to_string);
        [format!("{:02}", flags.len())].into_iter().chain(words).collect::<Vec<_>>().join(" ")
    }

    /// Travel in microsteps.
    fn limits(&self) -> [i64; 2] {
        let [a, b] = self.stage.travel_mm[self.index].map(|mm| self.axis.microsteps(mm).unwrap_or_default());
        [a.min(b), a.max(b)]
    }

    /// Home position: the least x and y, the greatest z.
    fn home_mm(&self) -> f64 {
        let [least, greatest] = self.stage.travel_mm[self.index];
        self.name.of([least, least, greatest])
    }

    fn speed_mm_per_s(&self) -> f64 {
        let told = speed_told(self.maxspeed) * self.axis.um_per_microstep / 1000.0;
        if self.maxspeed > 0 {
            told.min(self.stage.speed_max_mm_per_s)
        } else {
            self.stage.speed_max_mm_per_s
        }
    }

    fn acceleration_mm_per_s2(&self) -> f64 {
        let told = accel_told(self.accel) * self.axis.um_per_microstep / 1000.0;
        let greatest = self.stage.acceleration_mm_per_s2;
        if self.accel > 0 { told.min(greatest) } else { greatest }
    }
}

/// The more serious of two flags.
pub(super) fn graver(a: Flag, b: Flag) -> Flag {
    if gravity(b) > gravity(a) { b } else { a }
}

/// Rank of a flag by its letter: faults, warnings, notices.
fn gravity(flag: Flag) -> u8 {
    match flag.code().to_be_bytes() {
        [b'F', _] => 3,
        [b'W', _] => 2,
        [b'N', _] => 1,
        _ => 0,
    }
}

fn number(word: &str, least: i64) -> Result<i64, Rejection> {
    let number: i64 = word.parse().map_err(|_| Rejection::BadData)?;
    if (least..=i64::from(i32::MAX)).contains(&number) { Ok(number) } else { Err(Rejection::BadData) }
}
