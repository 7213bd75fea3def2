//! The driver of all arrays: it runs a session over a link.

use std::future::poll_fn;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use tactus_schema::{DeviceTick, Frame, FrameFlags, Rig, TimeStamp, pb};
use tactus_wire::sensor::{Action, Cause, Loss, Reading};
use tokio::sync::mpsc;
use tokio::time::sleep;
use tracing::Instrument as _;

use super::sequence::{GapCause, ReceivedFrame, Sequence};
use super::{Sensor, SensorCodec, SensorEvent};
use crate::backoff::Backoff;
use crate::link::{Link, LinkEvent, since_start};
use crate::transport::Connect;
use crate::{Clock, DeviceError, ErrorKind};

/// Events that may wait for the reader: four seconds of frames at 30 Hz.
const EVENTS_MAX: usize = 120;

/// A tactile array, read by a task of its own.
#[derive(Debug)]
pub struct SensorDriver {
    events: mpsc::Receiver<SensorEvent>,
}

/// The array as the rig file describes it.
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
    /// Frames per second to request. Missing frames are counted against it.
    pub rate_hz: f64,
    /// Least count of an element; 0 for one whose readings have no sign.
    pub least_counts: f64,
    /// Counts at the end of an element's range. A frame with an element at either end is marked as saturated.
    pub full_scale_counts: f64,
    /// True if no physical sensor is read.
    pub simulated: bool,
}

impl SensorDriver {
    /// Waits for the next event. Cancel-safe.
    pub async fn next(&mut self) -> SensorEvent {
        poll_fn(|context| self.poll_next(context)).await
    }

    /// Starts the task that owns the sensor. It ends when the returned value is dropped.
    ///
    /// A device that is silent or sends nothing new for a second is reported as [`ErrorKind::Timeout`]. One that does not
    /// speak the codec's protocol, or has another number of elements, is reported as [`ErrorKind::Protocol`].
    pub fn start(
        codec: SensorCodec,
        connect: Box<dyn Connect>,
        expect: ArrayExpectation,
        clock: Clock,
    ) -> Self {
        // Bounded. The reader is the service's sensor task, which always drains it. If it falls behind, frames are
        // dropped before they are numbered, and the next frame that fits reports the gap. Other events wait for room.
        let (sender, events) = mpsc::channel(EVENTS_MAX);
        let driver = Driver {
            device: format!("sensor on {connect}"),
            transport: connect.to_string(),
            sequence: Sequence::new(expect.rate_hz),
            held: vec![0.0; expect.elements()],
            codec,
            connect,
            expect,
            clock,
            events: sender,
            reported_loss: None,
            dropped: 0,
        };
        // Its log says of which rig it is.
        tokio::spawn(driver.run().in_current_span());
        Self { events }
    }
}

impl Sensor for SensorDriver {
    fn poll_next(&mut self, context: &mut Context<'_>) -> Poll<SensorEvent> {
        match self.events.poll_recv(context) {
            Poll::Ready(Some(event)) => Poll::Ready(event),
            // The task ends only with this reader, or with the runtime.
            Poll::Ready(None) | Poll::Pending => Poll::Pending,
        }
    }
}

impl ArrayExpectation {
    /// The array of a rig file.
    pub fn of(rig: &Rig) -> Self {
        Self {
            rig: rig.name.clone(),
            array: rig.array.name().to_owned(),
            rows: rig.array.rows(),
            cols: rig.array.cols(),
            rate_hz: rig.array.rate_hz(),
            least_counts: rig.array.least_counts(),
            full_scale_counts: rig.array.full_scale_counts(),
            simulated: rig.simulated,
        }
    }

    /// True if an element reads so at an end of its range. Many sensors rest at 0, so that it is no end.
    fn is_at_an_end(&self, counts: f32) -> bool {
        #[expect(clippy::cast_possible_truncation, reason = "as readings are stored")]
        let [least, most] = [self.least_counts, self.full_scale_counts].map(|end| end as f32);
        if least == 0.0 { counts.abs() >= most } else { counts >= most || counts <= least }
    }

    /// What the service says of the array, read over a link of this protocol and transport. `tick_ns`: tick of the device's clock, 0 if
    /// it has none.
    pub fn info(&self, tick_ns: u64, link: String, transport: String) -> pb::SensorInfo {
        pb::SensorInfo {
            rig: self.rig.clone(),
            array: self.array.clone(),
            rows: count(self.rows),
            cols: count(self.cols),
            rate_hz: self.rate_hz,
            full_scale_counts: self.full_scale_counts,
            tick_ns,
            link,
            transport,
            simulated: self.simulated,
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
    /// Each element's last reading in this epoch; 0 before the first.
    held: Vec<f32>,
    events: mpsc::Sender<SensorEvent>,
    /// The kind of the present loss, once it has been reported.
    reported_loss: Option<ErrorKind>,
    /// Readings dropped for lack of room since the last frame, and those missing before them by the device's count.
    dropped: u64,
}

/// The reader is gone, so the task ends.
struct Unread;

impl Driver {
    async fn run(mut self) {
        let mut backoff = Backoff::new();
        loop {
            let lost = match self.connect.connect().await {
                Ok(stream) => {
                    let link = Link::new(stream, self.clock, self.device.clone());
                    self.read_link(link, &mut backoff).await
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

    /// Reads from an open link until it fails; returns why.
    async fn read_link(&mut self, link: Link, backoff: &mut Backoff) -> Result<DeviceError, Unread> {
        let mut session = match self.codec.session(&self.expect) {
            Ok(session) => session,
            Err(loss) => return Ok(self.error(loss)),
        };
        let mut link = match session.packet_bytes() {
            // One byte more, so that a longer packet cannot look like a whole one.
            Some(bytes) => link.reading_at_least(bytes + 1),
            None => link,
        };
        self.sequence.set_tick(Duration::from_nanos(session.tick_ns()));
        let mut cause = GapCause::Reconnected;
        let mut now = self.clock.now();
        let mut actions = session.start(since_start(now));
        loop {
            let mut together = actions.iter().filter(|action| matches!(action, Action::Reading(_))).count();
            for action in actions.drain(..) {
                match action {
                    Action::Send(bytes) => {
                        if let Err(error) = link.send(&bytes).await {
                            return Ok(error);
                        }
                    }
                    Action::Connected { identity } => {
                        backoff.reset();
                        let (tick_ns, link) = (session.tick_ns(), session.name());
                        let info = self.expect.info(tick_ns, link, self.transport.clone());
                        self.connected(info, identity).await?;
                    }
                    Action::Reading(reading) => {
                        self.reading(now, reading, together, &mut cause)?;
                        together -= 1;
                    }
                    Action::Warning(what) => tracing::warn!(device = self.device, "{what}"),
                    Action::Lost(loss) => {
                        if loss.cause == Cause::Restarted {
                            cause = GapCause::Reconnected;
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
                event = link.next(session.deadline()) => event,
            };
            match event {
                Ok((stamp, LinkEvent::Received(bytes))) => {
                    now = stamp;
                    session.receive_into(since_start(now), bytes, &mut actions);
                }
                Ok((stamp, LinkEvent::Deadline)) => {
                    now = stamp;
                    actions = session.timer(since_start(now));
                }
                Err(error) => {
                    tracing::info!(device = self.device, quality = session.quality(), "sensor link ended");
                    return Ok(error);
                }
            }
        }
    }

    async fn connected(&mut self, info: pb::SensorInfo, identity: Option<String>) -> Result<(), Unread> {
        self.reported_loss = None;
        tracing::info!(device = self.device, identity, "sensor connected");
        self.emit(SensorEvent::Connected(Box::new(info))).await
    }

    /// Makes a frame from a reading. `together` counts it and the readings behind it that arrived at the same time.
    fn reading(
        &mut self,
        now: TimeStamp,
        reading: Reading,
        together: usize,
        cause: &mut GapCause,
    ) -> Result<(), Unread> {
        if reading.new_clock && *cause != GapCause::Reconnected {
            *cause = GapCause::ClockJumped;
        }
        // Room for the frame and for a gap before it.
        let Ok(room) = self.events.try_reserve_many(2) else {
            if self.events.is_closed() {
                return Err(Unread);
            }
            if self.dropped == 0 {
                tracing::warn!(device = self.device, "the reader is too slow: frames are dropped");
            }
            self.dropped += 1 + reading.evidence.counted();
            return Ok(());
        };
        if self.dropped > 0 {
            tracing::warn!(device = self.device, frames = self.dropped, "frames were dropped");
            if *cause == GapCause::Link {
                *cause = GapCause::HostTooSlow;
            }
        }
        let device_tick = reading.tick.map(DeviceTick);
        let placement = self.sequence.place(ReceivedFrame {
            tick: device_tick,
            evidence: reading.evidence,
            received: now.mono,
            together,
            dropped: std::mem::take(&mut self.dropped),
            cause: std::mem::replace(cause, GapCause::Link),
        });
        let mut flags = placement.flags;
        if flags.contains(FrameFlags::NEW_EPOCH) {
            self.held.fill(0.0);
        }
        for (element, (held, count)) in self.held.iter_mut().zip(reading.counts.iter()).enumerate() {
            if !is_listed(element, &reading.bad) {
                *held = *count;
            }
        }
        let counts: Arc<[f32]> =
            if reading.bad.is_empty() { reading.counts } else { self.held.as_slice().into() };
        if counts.iter().any(|count| self.expect.is_at_an_end(*count)) {
            flags = flags.with(FrameFlags::SATURATED);
        }
        if !reading.bad.is_empty() {
            flags = flags.with(FrameFlags::BAD_ELEMENTS);
        }
        let frame = Frame {
            seq: placement.seq,
            epoch: placement.epoch,
            device_tick,
            received: now,
            counts,
            flags,
            lost_before: placement.lost_before,
            simulated: self.expect.simulated,
            // No list takes no memory.
            bad_elements: if reading.bad.is_empty() { Arc::default() } else { reading.bad.into() },
            temperature_c: reading.temperature_c,
        };
        let gap = placement.gap.map(SensorEvent::Gap);
        for (permit, event) in room.zip(gap.into_iter().chain([SensorEvent::Frame(frame)])) {
            permit.send(event);
        }
        Ok(())
    }

    /// Reports a loss, unless the present loss has already been reported with this kind.
    async fn lost(&mut self, error: DeviceError) -> Result<(), Unread> {
        if self.reported_loss == Some(error.kind) {
            return Ok(());
        }
        tracing::warn!(%error, kind = ?error.kind, "sensor lost");
        self.reported_loss = Some(error.kind);
        self.emit(SensorEvent::Lost(error)).await
    }

    async fn emit(&self, event: SensorEvent) -> Result<(), Unread> {
        self.events.send(event).await.map_err(|_| Unread)
    }

    fn error(&self, loss: Loss) -> DeviceError {
        let kind = match loss.cause {
            Cause::Silent => ErrorKind::Timeout,
            Cause::Restarted => ErrorKind::Disconnected,
            Cause::Protocol => ErrorKind::Protocol,
            Cause::DeviceFault => ErrorKind::DeviceFault,
        };
        DeviceError::new(&self.device, kind, loss.what)
    }
}

/// Whether an element is in an ascending list.
fn is_listed(element: usize, elements: &[u32]) -> bool {
    elements.binary_search(&count(element)).is_ok()
}

fn count(number: usize) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}

#[cfg(test)]
#[path = "driver_tests.rs"]
mod tests;
