//! The driver of every array.

use std::sync::Arc;
use std::time::Duration;

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use tactus_schema::{Frame, FrameFlags, Rig, TimeStamp, pb};
use tokio::sync::mpsc;
use tokio::time::sleep;

use super::conversation::{Action, Before, Loss, Reading};
use super::sequence::{Arrival, Cause, Sequence};
use super::{Sensor, SensorCodec, SensorEvent};
use crate::backoff::Backoff;
use crate::link::{Link, LinkEvent, since_start};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Events that may wait to be taken: four seconds of frames at 30 Hz.
const EVENTS_MAX: usize = 120;

/// A tactile array that is read by its codec.
#[derive(Debug)]
pub struct SensorDriver {
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

impl SensorDriver {
    /// Starts the task that owns the sensor. It ends when what this returns is dropped.
    ///
    /// A device that is silent for a second, or repeats itself, is [`ErrorKind::Timeout`]; one that speaks otherwise
    /// than `codec`, or has another number of elements, is [`ErrorKind::Protocol`].
    pub fn start(
        codec: SensorCodec,
        connect: Box<dyn Connect>,
        expect: ArrayExpectation,
        clock: Clock,
    ) -> Self {
        // Bounded. The reader is the service's one sensor task, which always drains. Should it fall behind, frames
        // are passed over before they are numbered, and the gap is told with the next that fits; all other events
        // wait for room.
        let (sender, events) = mpsc::channel(EVENTS_MAX);
        let driver = Driver {
            device: format!("sensor on {connect}"),
            transport: connect.to_string(),
            sequence: Sequence::new(expect.rate_hz, Duration::from_nanos(codec.tick_ns())),
            held: vec![0.0; expect.elements()],
            codec,
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

impl Sensor for SensorDriver {
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

    pub(super) fn elements(&self) -> usize {
        self.rows * self.cols
    }
}

struct Driver {
    codec: SensorCodec,
    connect: Box<dyn Connect>,
    expect: ArrayExpectation,
    clock: Clock,
    device: String,
    transport: String,
    sequence: Sequence,
    /// The last reading of each element in this epoch; 0 without one.
    held: Vec<f32>,
    events: mpsc::Sender<SensorEvent>,
    /// The kind of loss that was told and has not been made good.
    told: Option<ErrorKind>,
    /// Readings that found no room since the last that did, and those that the device said were missing before them.
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
    async fn converse(&mut self, link: Link, backoff: &mut Backoff) -> Result<DeviceError, Unread> {
        let mut link = match self.codec.packet_bytes() {
            // Room for one byte more: a longer packet must not look like a whole one.
            Some(bytes) => link.reading_at_least(bytes + 1),
            None => link,
        };
        let mut conversation = match self.codec.converse(&self.expect, &self.device) {
            Ok(conversation) => conversation,
            Err(loss) => return Ok(self.error(loss)),
        };
        let mut cause = Cause::Reconnected;
        let mut now = self.clock.now();
        let mut actions = conversation.start(since_start(now));
        loop {
            let mut together = actions.iter().filter(|action| matches!(action, Action::Reading(_))).count();
            for action in actions {
                match action {
                    Action::Send(bytes) => {
                        if let Err(error) = link.send(&bytes).await {
                            return Ok(error);
                        }
                    }
                    Action::Connected => {
                        backoff.reset();
                        self.connected().await?;
                    }
                    Action::Reading(reading) => {
                        self.reading(now, reading, together, &mut cause)?;
                        together -= 1;
                    }
                    Action::Lost(loss) => {
                        if loss.restarted {
                            cause = Cause::Reconnected;
                        }
                        let error = self.error(loss);
                        self.lost(error).await?;
                    }
                    Action::Failed(loss) => return Ok(self.error(loss)),
                }
            }
            let event = tokio::select! {
                biased;
                () = self.events.closed() => return Err(Unread),
                event = link.next(conversation.deadline()) => event,
            };
            actions = match event {
                Ok((stamp, LinkEvent::Received(bytes))) => {
                    now = stamp;
                    conversation.receive(since_start(now), bytes)
                }
                Ok((stamp, LinkEvent::Deadline)) => {
                    now = stamp;
                    conversation.timer(since_start(now))
                }
                Err(error) => {
                    tracing::info!(device = self.device, met = conversation.quality(), "sensor link ended");
                    return Ok(error);
                }
            };
        }
    }

    async fn connected(&mut self) -> Result<(), Unread> {
        self.told = None;
        tracing::info!(device = self.device, "sensor connected");
        let info = pb::SensorInfo {
            rig: self.expect.rig.clone(),
            array: self.expect.array.clone(),
            rows: count(self.expect.rows),
            cols: count(self.expect.cols),
            rate_hz: self.expect.rate_hz,
            full_scale_counts: self.expect.full_scale_counts,
            tick_ns: self.codec.tick_ns(),
            link: self.codec.name(),
            transport: self.transport.clone(),
            simulated: self.expect.simulated,
        };
        self.tell(SensorEvent::Connected(info)).await
    }

    /// Makes a frame of a reading, the first of `together` that came at once.
    fn reading(
        &mut self,
        now: TimeStamp,
        reading: Reading,
        together: usize,
        cause: &mut Cause,
    ) -> Result<(), Unread> {
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
            self.passed_over += 1 + reading.before.missing();
            return Ok(());
        };
        if self.passed_over > 0 {
            tracing::warn!(device = self.device, frames = self.passed_over, "frames were passed over");
            if *cause == Cause::Link {
                *cause = Cause::HostTooSlow;
            }
        }
        let place = self.sequence.place(Arrival {
            tick: reading.tick,
            before: reading.before,
            received: now.mono,
            together,
            passed_over: std::mem::take(&mut self.passed_over),
            cause: std::mem::replace(cause, Cause::Link),
        });
        let mut flags = place.flags;
        if flags.contains(FrameFlags::NEW_EPOCH) {
            self.held.fill(0.0);
        }
        for (element, (held, count)) in self.held.iter_mut().zip(&reading.counts).enumerate() {
            if !is_listed(element, &reading.bad) {
                *held = *count;
            }
        }
        let counts: Arc<[f32]> = self.held.as_slice().into();
        if counts.iter().any(|count| f64::from(count.abs()) >= self.expect.full_scale_counts) {
            flags = flags.with(FrameFlags::SATURATED);
        }
        if !reading.bad.is_empty() {
            flags = flags.with(FrameFlags::BAD_ELEMENTS);
        }
        let frame = Frame {
            seq: place.seq,
            epoch: place.epoch,
            device_tick: reading.tick,
            received: now,
            counts,
            flags,
            lost_before: place.lost_before,
            simulated: self.expect.simulated,
            bad_elements: reading.bad.into(),
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

    fn error(&self, loss: Loss) -> DeviceError {
        DeviceError::new(&self.device, loss.kind, loss.what)
    }
}

impl Before {
    /// What the device itself says is missing.
    fn missing(self) -> u64 {
        match self {
            Self::Numbers { lost, .. } => lost,
            Self::Times | Self::Damage => 0,
        }
    }
}

/// Whether an element is in a list in order.
fn is_listed(element: usize, elements: &[u32]) -> bool {
    elements.binary_search(&count(element)).is_ok()
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
