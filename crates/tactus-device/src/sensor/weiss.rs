//! The driver of arrays that speak `weiss-dsa`.

use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::{DeviceTick, Frame, Rig, Stamp, pb};
use tactus_wire::weiss::{Action, Checksum, Config, Device, Loss, Reading, Session, SessionError};
use tokio::sync::mpsc;
use tokio::time::sleep;

use super::sequence::{Cause, Sequence};
use super::{Sensor, SensorEvent};
use crate::backoff::Backoff;
use crate::link::{Link, LinkEvent, since_start};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Length of the device's tick.
const TICK: Duration = Duration::from_millis(1);

/// Events that may wait to be taken: four seconds of frames at 30 Hz.
const EVENTS_MAX: usize = 120;

/// A tactile array that speaks `weiss-dsa`.
#[derive(Debug)]
pub struct WeissSensor {
    events: mpsc::Receiver<SensorEvent>,
}

/// The array that the rig says is there.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrayExpectation {
    /// Name of the rig.
    pub rig: String,
    /// Name of the array.
    pub array: String,
    /// Its rows.
    pub rows: usize,
    /// Its columns.
    pub cols: usize,
    /// Frames a second to ask for; lost frames are counted against it.
    pub rate_hz: f64,
    /// The end of an element's range.
    pub full_scale_counts: f64,
    /// True if no physical sensor is read.
    pub simulated: bool,
}

impl WeissSensor {
    /// Starts the task that owns the sensor. It ends when what this returns is dropped.
    ///
    /// A device that sends frames with another number of elements is [`ErrorKind::Protocol`]; one from
    /// which no fresh frame has come for a second is [`ErrorKind::Timeout`], and asked again.
    pub fn start(connect: Box<dyn Connect>, expect: ArrayExpectation, clock: Clock) -> Self {
        // Bounded. The reader is the service's one sensor task, which always drains. Should it fall behind, frames
        // are passed over before they are numbered, and the gap is told with the next that fits; all other events
        // wait for room.
        let (sender, events) = mpsc::channel(EVENTS_MAX);
        let driver = Driver {
            device: format!("sensor on {connect}"),
            transport: connect.to_string(),
            sequence: Sequence::new(expect.rate_hz, TICK),
            connect,
            expect,
            clock,
            events: sender,
            told: None,
            passed_over: 0,
        };
        tokio::spawn(driver.run());
        Self { events }
    }
}

impl Sensor for WeissSensor {
    fn next(&mut self) -> BoxFuture<'_, SensorEvent> {
        async {
            match self.events.recv().await {
                Some(event) => event,
                // The task ends only with this reader, or with the runtime.
                None => std::future::pending().await,
            }
        }
        .boxed()
    }
}

impl ArrayExpectation {
    /// What a rig description says.
    pub fn of(rig: &Rig) -> Self {
        Self {
            rig: rig.name.clone(),
            array: rig.array.name().to_owned(),
            rows: rig.array.rows(),
            cols: rig.array.cols(),
            rate_hz: rig.array.rate_hz(),
            full_scale_counts: rig.array.full_scale_counts(),
            simulated: rig.simulated,
        }
    }

    fn config(&self) -> Config {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, as it should"
        )]
        let fps = self.rate_hz.round() as u16;
        Config { elements: self.rows * self.cols, fps, run_length: false, checksum: Checksum::Crc }
    }
}

struct Driver {
    connect: Box<dyn Connect>,
    expect: ArrayExpectation,
    clock: Clock,
    device: String,
    transport: String,
    sequence: Sequence,
    events: mpsc::Sender<SensorEvent>,
    /// The kind of loss that was told and has not been made good.
    told: Option<ErrorKind>,
    /// Frames that found no room since the last that did.
    passed_over: u64,
}

/// The reader has gone: the task is to end.
struct Unread;

impl Driver {
    async fn run(mut self) {
        let mut backoff = Backoff::new();
        loop {
            let lost = match self.connect.connect().await {
                Ok(stream) => {
                    let link = Link::new(stream, self.clock, self.device.clone());
                    self.converse(link, &mut backoff).await
                }
                Err(error) => Ok(error),
            };
            let Ok(error) = lost else { return };
            if self.lost(error).await.is_err() {
                return;
            }
            tokio::select! {
                biased;
                () = self.events.closed() => return,
                () = sleep(backoff.pause()) => {}
            }
        }
    }

    /// Reads from an open link until it fails; gives why.
    async fn converse(&mut self, mut link: Link, backoff: &mut Backoff) -> Result<DeviceError, Unread> {
        let mut session = Session::new(self.expect.config());
        let mut cause = Cause::Reconnected;
        let mut now = self.clock.now();
        let mut actions = session.start(since_start(now));
        loop {
            for action in actions {
                match action {
                    Action::Send(bytes) => {
                        if let Err(error) = link.send(&bytes).await {
                            return Ok(error);
                        }
                    }
                    Action::Connected(device) => {
                        backoff.reset();
                        self.connected(&device).await?;
                    }
                    Action::Frame(reading) => self.frame(now, &reading, &mut cause)?,
                    Action::Lost(loss) => {
                        if loss == Loss::Restarted {
                            cause = Cause::Reconnected;
                        }
                        self.lost(self.describe_loss(loss)).await?;
                    }
                    Action::Failed(error) => return Ok(self.describe_failure(error)),
                }
            }
            let event = tokio::select! {
                biased;
                () = self.events.closed() => return Err(Unread),
                event = link.next(session.deadline()) => event,
            };
            actions = match event {
                Ok((stamp, LinkEvent::Received(bytes))) => {
                    now = stamp;
                    session.receive(since_start(now), bytes)
                }
                Ok((stamp, LinkEvent::Deadline)) => {
                    now = stamp;
                    session.timer(since_start(now))
                }
                Err(error) => {
                    log_quality(&self.device, &session);
                    return Ok(error);
                }
            };
        }
    }

    async fn connected(&mut self, device: &Device) -> Result<(), Unread> {
        self.told = None;
        tracing::info!(
            device = self.device,
            controller_serial = device.controller.serial_number,
            controller_software = device.controller.software_version,
            sensor_serial = device.sensor.serial_number,
            "sensor connected"
        );
        let (rows, cols) = (count(self.expect.rows), count(self.expect.cols));
        let matrix = [device.matrix.cells_y, device.matrix.cells_x].map(u32::from);
        if matrix != [rows, cols] {
            tracing::warn!(device = self.device, ?matrix, expected = ?[rows, cols], "the matrix says other rows and columns");
        }
        let info = pb::SensorInfo {
            rig: self.expect.rig.clone(),
            array: self.expect.array.clone(),
            rows,
            cols,
            rate_hz: self.expect.rate_hz,
            full_scale_counts: self.expect.full_scale_counts,
            tick_ns: u64::try_from(TICK.as_nanos()).unwrap_or(u64::MAX),
            link: "weiss-dsa".to_owned(),
            transport: self.transport.clone(),
            simulated: self.expect.simulated,
        };
        self.tell(SensorEvent::Connected(info)).await
    }

    fn frame(&mut self, now: Stamp, reading: &Reading, cause: &mut Cause) -> Result<(), Unread> {
        if reading.new_clock && *cause != Cause::Reconnected {
            *cause = Cause::ClockJumped;
        }
        // Room for the frame and for a gap before it.
        let Ok(room) = self.events.try_reserve_many(2) else {
            if self.events.is_closed() {
                return Err(Unread);
            }
            if self.passed_over == 0 {
                tracing::warn!(device = self.device, "frames are not taken: they are passed over");
            }
            self.passed_over += 1;
            return Ok(());
        };
        if self.passed_over > 0 {
            tracing::warn!(device = self.device, frames = self.passed_over, "frames were passed over");
            self.passed_over = 0;
            if *cause == Cause::Link {
                *cause = Cause::HostTooSlow;
            }
        }
        let device_tick = DeviceTick(reading.tick_ms);
        let place = self.sequence.place(device_tick, now.mono, std::mem::replace(cause, Cause::Link));
        let counts: std::sync::Arc<[f32]> = reading.counts.iter().map(|count| f32::from(*count)).collect();
        let saturated = counts.iter().any(|count| f64::from(*count) >= self.expect.full_scale_counts);
        let flags =
            if saturated { place.flags.with(tactus_schema::FrameFlags::SATURATED) } else { place.flags };
        let frame = Frame {
            seq: place.seq,
            epoch: place.epoch,
            device_tick: Some(device_tick),
            received: now,
            counts,
            flags,
            lost_before: place.lost_before,
            simulated: self.expect.simulated,
        };
        let gap = place.gap.map(SensorEvent::Gap);
        for (permit, event) in room.zip(gap.into_iter().chain([SensorEvent::Frame(frame)])) {
            permit.send(event);
        }
        Ok(())
    }

    /// Tells a loss, unless one of its kind has been told and not been made good.
    async fn lost(&mut self, error: DeviceError) -> Result<(), Unread> {
        if self.told == Some(error.kind) {
            return Ok(());
        }
        tracing::warn!(%error, kind = ?error.kind, "sensor lost");
        self.told = Some(error.kind);
        self.tell(SensorEvent::Lost(error)).await
    }

    async fn tell(&self, event: SensorEvent) -> Result<(), Unread> {
        self.events.send(event).await.map_err(|_| Unread)
    }

    fn describe_loss(&self, loss: Loss) -> DeviceError {
        let kind = match loss {
            Loss::Silent => ErrorKind::Timeout,
            Loss::Restarted => ErrorKind::Disconnected,
        };
        DeviceError::new(&self.device, kind, loss.to_string())
    }

    fn describe_failure(&self, error: SessionError) -> DeviceError {
        let (kind, remedy) = match error {
            SessionError::Silent { .. } => {
                (ErrorKind::Timeout, "is it the sensor, is it switched on, and is the bit rate right?")
            }
            SessionError::Refused { .. } => (ErrorKind::DeviceFault, "see the controller's manual"),
            SessionError::Answer(_) | SessionError::Frame(_) => {
                (ErrorKind::Protocol, "is it the sensor that the rig file describes?")
            }
        };
        DeviceError::new(&self.device, kind, format!("{error}: {remedy}"))
    }
}

fn log_quality(device: &str, session: &Session) {
    let stats = session.decoder_stats();
    tracing::info!(
        device,
        bad_checksums = stats.bad_checksums,
        skipped_bytes = stats.skipped_bytes,
        stale_frames = session.stale_frames(),
        "sensor link ended"
    );
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
#[path = "weiss_tests.rs"]
mod tests;
