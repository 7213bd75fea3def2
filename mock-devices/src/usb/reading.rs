//! A virtual sensor that sends frames of a described format, unasked, one after the other: what sits behind HID
//! and vendor bulk.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tactus_wire::declared::{Encoder, Format};
use tokio::time::Instant;

use crate::cable::Device;
use crate::faults::{LinkFault, SensorFault};
use crate::world::Shared;

/// Samplings that are later than this are passed over: a machine too slow for the rate would otherwise never catch up.
const BACKLOG: Duration = Duration::from_secs(1);

/// The format has no room for what the array reads.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the link file {name:?} describes {expected} elements, and the rig's array has {found}; choose another of either"
)]
pub(crate) struct ShapeError {
    name: String,
    expected: usize,
    found: usize,
}

/// An array whose firmware sends a frame at each of its periods, from the moment it has power.
#[derive(Debug)]
pub(crate) struct DeclaredSensor {
    world: Shared,
    encoder: Encoder,
    format: Arc<Format>,
    rate_hz: f64,
    /// The clock's zero.
    powered_up: Instant,
    clock_offset_ms: i64,
    /// Number of the next sampling on the grid.
    next: u64,
    counts: Vec<u16>,
    /// Elements that do not read what they feel, with what they read instead.
    overridden: BTreeMap<usize, f32>,
    stalled_until: Option<Instant>,
    drop_frames: usize,
    outgoing: Vec<u8>,
}

impl DeclaredSensor {
    /// An array that is switched on now.
    ///
    /// # Errors
    /// A format with another number of elements than the array.
    pub(crate) fn new(world: Shared, format: Arc<Format>, now: Instant) -> Result<Self, ShapeError> {
        let (found, rate_hz) = {
            let world = world.lock();
            let array = world.truth().model.array();
            (array.elements(), array.rate_hz())
        };
        let expected = format.samples().elements();
        if expected != found {
            return Err(ShapeError { name: format.name().to_owned(), expected, found });
        }
        Ok(Self {
            world,
            encoder: Encoder::new(Arc::clone(&format)),
            format,
            rate_hz,
            powered_up: now,
            clock_offset_ms: 0,
            next: 1,
            counts: Vec::new(),
            overridden: BTreeMap::new(),
            stalled_until: None,
            drop_frames: 0,
            outgoing: Vec::new(),
        })
    }

    /// True for the faults that such an array can have: its frames are all of one length and well-formed.
    pub(crate) fn takes(fault: SensorFault) -> bool {
        match fault {
            SensorFault::Link(LinkFault::Stall(_) | LinkFault::DropFrames(_))
            | SensorFault::ClockJump { .. }
            | SensorFault::Stuck(_)
            | SensorFault::Saturate(_)
            | SensorFault::Clear => true,
            SensorFault::Link(_) | SensorFault::ClockWrap => false,
        }
    }

    /// When the next sampling takes place: computed from the grid's beginning, so that nothing adds up.
    fn next_sampling(&self) -> Instant {
        self.powered_up + Duration::from_secs_f64(self.next as f64 / self.rate_hz)
    }

    fn take_frame(&mut self, at: Instant) {
        self.world.lock().sample(at, &mut self.counts);
        let is_lost = self.stalled_until.is_some_and(|until| at < until) || self.drop_frames > 0;
        self.drop_frames = self.drop_frames.saturating_sub(1);
        if is_lost {
            self.encoder.lose_frame();
            return;
        }
        let mut reading: Vec<f32> = self.counts.iter().map(|count| f32::from(*count)).collect();
        for (element, count) in &self.overridden {
            if let Some(read) = reading.get_mut(*element) {
                *read = *count;
            }
        }
        let tick = self.tick(at);
        match self.encoder.encode(tick, &reading) {
            Ok(frame) => self.outgoing.extend_from_slice(frame),
            Err(error) => unreachable!("the number of elements was checked: {error}"),
        }
    }

    /// The device's clock in its ticks; it wraps as the format says.
    fn tick(&self, at: Instant) -> u64 {
        let elapsed_ns = i128::try_from(at.duration_since(self.powered_up).as_nanos()).unwrap_or(i128::MAX);
        let clock_ns = elapsed_ns + 1_000_000 * i128::from(self.clock_offset_ms);
        let tick_ns = self.format.tick_ns().unwrap_or(1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        let tick = (clock_ns.max(0) as f64 / tick_ns) as u64;
        tick
    }
}

impl Device for DeclaredSensor {
    type Fault = SensorFault;

    /// It is never asked anything.
    fn receive(&mut self, _bytes: &[u8], _now: Instant) {}

    fn wake(&mut self, now: Instant) {
        while self.next_sampling() + BACKLOG < now {
            self.next += 1;
            self.encoder.lose_frame();
        }
        while self.next_sampling() <= now {
            let at = self.next_sampling();
            self.next += 1;
            self.take_frame(at);
        }
    }

    fn next_wake(&self) -> Option<Instant> {
        Some(self.next_sampling())
    }

    fn output(&mut self, _now: Instant) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    fn fault(&mut self, fault: SensorFault, now: Instant) {
        match fault {
            SensorFault::Link(LinkFault::Stall(duration)) => self.stalled_until = Some(now + duration),
            SensorFault::Link(LinkFault::DropFrames(frames)) => self.drop_frames += frames,
            SensorFault::ClockJump { ms } => self.clock_offset_ms = self.clock_offset_ms.saturating_add(ms),
            SensorFault::Stuck(element) => {
                let count = self.counts.get(element).copied().unwrap_or(0);
                self.overridden.insert(element, count.into());
            }
            SensorFault::Saturate(element) => {
                #[expect(clippy::cast_possible_truncation, reason = "whole counts of a converter")]
                let full_scale = self.world.lock().truth().readout.read(f64::INFINITY, 0.0) as f32;
                self.overridden.insert(element, full_scale);
            }
            SensorFault::Clear => {
                self.overridden.clear();
                self.stalled_until = None;
                self.drop_frames = 0;
            }
            // What it does not take is refused where it is typed.
            SensorFault::Link(_) | SensorFault::ClockWrap => {}
        }
    }

    fn plugged_in(&mut self, now: Instant) {
        self.powered_up = now;
        self.clock_offset_ms = 0;
        self.next = 1;
        self.encoder = Encoder::new(Arc::clone(&self.format));
        self.outgoing.clear();
    }
}

#[cfg(test)]
#[path = "reading_tests.rs"]
mod tests;
