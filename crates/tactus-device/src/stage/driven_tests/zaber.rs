//! A stage of Zaber devices whose other end is a script: what the driver says, and when.

use std::sync::Arc;
use std::time::Duration;

use tactus_schema::pb::StageStatus;
use tactus_schema::rig::{StageProtocol, ZaberAxes, ZaberAxis};
use tactus_wire::zaber::{Flag, Header, HostCommand, HostCommandDecoder, Message};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep};

use super::{OPTIONS, drain, homing, permit, until};
use crate::transport::memory::pair;
use crate::{Clock, Connection, DrivenStage, ErrorKind, Stage, StageError, Target};

/// One axis, z, of device 1.
fn protocol() -> StageProtocol {
    let z = ZaberAxis {
        device: 1,
        axis: 1,
        um_per_microstep: 0.5,
        is_forward: true,
        origin_microsteps: 0,
        resolution: Some(64),
    };
    StageProtocol::Zaber(ZaberAxes {
        axes: [None, None, Some(z)],
        accel_mm_per_s2: None,
        homing_speed_mm_per_s: None,
        checksums: false,
        trusts_reference: false,
    })
}

/// The devices' end of the line.
struct Devices {
    stream: DuplexStream,
    ear: HostCommandDecoder,
    flag: Flag,
    busy: bool,
    position: i64,
    resolution: u32,
}

impl Devices {
    fn new(stream: DuplexStream) -> Self {
        let ear = HostCommandDecoder::default();
        Self { stream, ear, flag: Flag::NO_REFERENCE, busy: false, position: 0, resolution: 64 }
    }

    /// The commands that come next.
    async fn hear(&mut self) -> Vec<HostCommand> {
        let mut buffer = [0; 256];
        let count = self.stream.read(&mut buffer).await.unwrap();
        let mut commands = Vec::new();
        self.ear.push(&buffer[..count], |command| commands.push(command));
        commands
    }

    /// Answers until a command begins so; gives that, unanswered.
    async fn answer_until(&mut self, text: &str) -> HostCommand {
        loop {
            for command in self.hear().await {
                if command.text.starts_with(text) {
                    return command;
                }
                self.answer(&command).await;
            }
        }
    }

    async fn answer(&mut self, command: &HostCommand) {
        let data = match command.text.as_str() {
            "get version" => "7.38".to_owned(),
            "get system.axiscount" => "1".to_owned(),
            "get resolution" => self.resolution.to_string(),
            "get limit.max" => "100000".to_owned(),
            "get pos" => self.position.to_string(),
            "warnings" if self.flag == Flag::NONE => "00".to_owned(),
            "warnings" => format!("01 {}", self.flag),
            "home" => {
                self.flag = Flag::NONE;
                "0".to_owned()
            }
            _ => "0".to_owned(),
        };
        let header = Header { device: 1, axis: command.axis, id: command.id };
        let (busy, flag) = (self.busy, self.flag);
        let reply = Message::Reply { header, accepted: true, busy, flag, data };
        self.stream.write_all(&reply.encode(false)).await.unwrap();
    }

    /// Answers for ever, a little after each question.
    async fn go_on(mut self) {
        loop {
            for command in self.hear().await {
                sleep(Duration::from_millis(5)).await;
                self.answer(&command).await;
            }
        }
    }
}

async fn plugged_in(resolution: u32) -> (Arc<DrivenStage>, Devices) {
    let (connector, mut port) = pair("stage");
    let (stage, reports) = DrivenStage::start(Box::new(connector), &protocol(), OPTIONS, Clock::paused());
    tokio::spawn(drain(reports));
    let devices = Devices { resolution, ..Devices::new(port.accept().await) };
    // Kept, so that the line stays plugged in.
    tokio::spawn(async move {
        port.accept().await;
    });
    (stage, devices)
}

fn up() -> Target {
    Target { position_mm: [0.0, 0.0, 10.0], speed_mm_per_s: 5.0 }
}

#[tokio::test(start_paused = true)]
async fn stop_goes_out_at_once_while_a_reply_is_awaited() {
    let (stage, mut devices) = plugged_in(64).await;
    let homing = tokio::spawn({
        let stage = Arc::clone(&stage);
        async move {
            until(&stage, StageStatus::Unhomed).await;
            stage.home(homing()).await.unwrap();
            stage.move_to(permit(up())).await
        }
    });
    // The move is heard, and not answered.
    devices.answer_until("move abs 20000").await;
    sleep(Duration::from_millis(30)).await;
    let pressed = Instant::now();
    stage.stop();
    let next = devices.hear().await;
    assert_eq!((next[0].text.as_str(), next[0].device, Instant::now()), ("stop", 0, pressed));
    devices.position = 1_234;
    devices.answer(&next[0]).await;
    tokio::spawn(devices.go_on());
    let Err(StageError::Stopped { position_mm }) = homing.await.unwrap() else { panic!() };
    assert!((position_mm[2] - 0.617).abs() < 1e-9, "{position_mm:?}");
}

#[tokio::test(start_paused = true)]
async fn a_knob_that_is_turned_ends_the_move_by_name() {
    let (stage, mut devices) = plugged_in(64).await;
    let moving = tokio::spawn({
        let stage = Arc::clone(&stage);
        async move {
            until(&stage, StageStatus::Unhomed).await;
            stage.home(homing()).await.unwrap();
            stage.move_to(permit(up())).await
        }
    });
    let command = devices.answer_until("move abs 20000").await;
    devices.busy = true;
    devices.answer(&command).await;
    devices.answer_until("get pos").await;
    (devices.busy, devices.flag) = (false, Flag::MANUAL_CONTROL);
    tokio::spawn(devices.go_on());
    let result = moving.await.unwrap();
    let Err(error @ StageError::Interrupted { .. }) = result else { panic!("{result:?}") };
    assert!(error.to_string().starts_with("z was moved by someone else"), "{error}");
}

#[tokio::test(start_paused = true)]
async fn devices_that_are_not_the_rigs_are_refused_with_both_values() {
    let (stage, devices) = plugged_in(128).await;
    tokio::spawn(devices.go_on());
    let mut connection = stage.connection();
    let why = connection.wait_for(|now| matches!(now, Connection::Seeking(Some(_)))).await.unwrap().clone();
    let Connection::Seeking(Some(error)) = why else { panic!() };
    assert_eq!(error.kind, ErrorKind::DeviceFault);
    assert!(error.what.contains("resolution = 128 on z, but the rig needs 64"), "{error}");
}
