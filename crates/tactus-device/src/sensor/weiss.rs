//! Arrays that speak `weiss-dsa`.

use std::time::Duration;

use tactus_schema::DeviceTick;
use tactus_wire::weiss::{self, Checksum, Config, Device, Session, SessionError};

use super::conversation::{Action, Before, Conversation, Loss, Reading};
use super::driver::ArrayExpectation;
use crate::ErrorKind;

/// Length of the device's tick.
pub(super) const TICK: Duration = Duration::from_millis(1);

/// A session with a controller.
#[derive(Debug)]
pub(super) struct Controller {
    session: Session,
    /// For the log.
    device: String,
    /// Rows and columns that the rig says are there.
    shape: [usize; 2],
}

impl Controller {
    pub(super) fn new(checksum: Checksum, expect: &ArrayExpectation, device: &str) -> Self {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let fps = expect.rate_hz.round() as u16;
        let config = Config { elements: expect.elements(), fps, run_length: false, checksum };
        Self { session: Session::new(config), device: device.to_owned(), shape: [expect.rows, expect.cols] }
    }

    fn translate(&self, actions: Vec<weiss::Action>) -> Vec<Action> {
        actions.into_iter().map(|action| self.translate_one(action)).collect()
    }

    fn translate_one(&self, action: weiss::Action) -> Action {
        match action {
            weiss::Action::Send(bytes) => Action::Send(bytes),
            weiss::Action::Connected(device) => {
                self.log(&device);
                Action::Connected
            }
            weiss::Action::Frame(reading) => Action::Reading(Reading {
                tick: Some(DeviceTick(reading.tick_ms)),
                new_clock: reading.new_clock,
                before: Before::Times,
                counts: reading.counts.into_iter().map(f32::from).collect(),
                bad: Vec::new(),
            }),
            weiss::Action::Lost(loss) => Action::Lost(describe_loss(loss)),
            weiss::Action::Failed(error) => Action::Failed(describe_failure(error)),
        }
    }

    fn log(&self, device: &Device) {
        tracing::info!(
            device = self.device,
            controller_serial = device.controller.serial_number,
            controller_software = device.controller.software_version,
            sensor_serial = device.sensor.serial_number,
            "the controller answers"
        );
        let matrix = [device.matrix.cells_y, device.matrix.cells_x].map(usize::from);
        if matrix != self.shape {
            tracing::warn!(device = self.device, ?matrix, expected = ?self.shape, "the matrix says other rows and columns");
        }
    }
}

impl Conversation for Controller {
    fn start(&mut self, now: Duration) -> Vec<Action> {
        let actions = self.session.start(now);
        self.translate(actions)
    }

    fn receive(&mut self, now: Duration, bytes: &[u8]) -> Vec<Action> {
        let actions = self.session.receive(now, bytes);
        self.translate(actions)
    }

    fn timer(&mut self, now: Duration) -> Vec<Action> {
        let actions = self.session.timer(now);
        self.translate(actions)
    }

    fn deadline(&self) -> Option<Duration> {
        self.session.deadline()
    }

    fn quality(&self) -> String {
        let (stats, stale) = (self.session.decoder_stats(), self.session.stale_frames());
        format!(
            "{} bad checksums, {} bytes skipped, {stale} stale frames",
            stats.bad_checksums, stats.skipped_bytes
        )
    }
}

fn describe_loss(loss: weiss::Loss) -> Loss {
    let (kind, restarted) = match loss {
        weiss::Loss::Silent => (ErrorKind::Timeout, false),
        weiss::Loss::Restarted => (ErrorKind::Disconnected, true),
    };
    Loss { restarted, ..Loss::new(kind, loss.to_string()) }
}

fn describe_failure(error: SessionError) -> Loss {
    let (kind, remedy) = match error {
        SessionError::Silent { .. } => {
            (ErrorKind::Timeout, "is it the sensor, is it switched on, and is the bit rate right?")
        }
        SessionError::Refused { .. } => (ErrorKind::DeviceFault, "see the controller's manual"),
        SessionError::Answer(_) | SessionError::Frame(_) => {
            (ErrorKind::Protocol, "is it the sensor that the rig file describes?")
        }
    };
    Loss::new(kind, format!("{error}: {remedy}"))
}
