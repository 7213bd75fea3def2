//! One reading of all elements, as the service passes it on.

use std::sync::Arc;

use prost::encoding::{bool, float, int64, uint32, uint64};

use crate::{DeviceTick, MonoTime, TimeStamp, WallTime, pb};

/// One reading of all elements; cheap to clone.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Counts every frame that the sensor took, including lost ones; see [`pb::Frame::seq`].
    pub seq: u64,
    /// Rises by one with every (re)connection.
    pub epoch: u32,
    /// The device's clock at the sampling; `None` if it has no clock.
    pub device_tick: Option<DeviceTick>,
    /// When the last byte of the frame reached the host.
    pub received: TimeStamp,
    /// Raw counts, row-major, one per element; always finite. An element that was not read has its last reading of this
    /// epoch, or 0.
    pub counts: Arc<[f32]>,
    /// Gaps, saturation, unread elements.
    pub flags: FrameFlags,
    /// Number of frames known to be lost just before this one.
    pub lost_before: u32,
    /// True if no physical sensor was read.
    pub simulated: bool,
    /// Indices of elements that were not read, ascending; [`FrameFlags::BAD_ELEMENTS`] is set if there are any.
    pub bad_elements: Arc<[u32]>,
    /// Temperature of the sensor in degrees Celsius, the mean where it has several; finite. `None` if it tells none.
    pub temperature_c: Option<f32>,
}

/// Bits of [`pb::FrameFlag`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameFlags(pub u32);

impl FrameFlags {
    /// At least one frame before this one is missing.
    pub const GAP_BEFORE: Self = Self(pb::FrameFlag::GapBefore as u32);
    /// The first frame after a (re)connection.
    pub const NEW_EPOCH: Self = Self(pb::FrameFlag::NewEpoch as u32);
    /// At least one element is at the end of its range.
    pub const SATURATED: Self = Self(pb::FrameFlag::Saturated as u32);
    /// At least one element was not read.
    pub const BAD_ELEMENTS: Self = Self(pb::FrameFlag::BadElements as u32);

    /// True if every bit of `other` is set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The union of both sets of bits.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Frame {
    /// Appends the frame as [`pb::Frame`] is encoded, without making one.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        let Self { seq, epoch, device_tick, received, counts, flags, lost_before, .. } = self;
        let Self { simulated, bad_elements, temperature_c, .. } = self;
        // In proto3 a field that is zero is left out, unless it is optional.
        if *seq != 0 {
            uint64::encode(1, seq, bytes);
        }
        if *epoch != 0 {
            uint32::encode(2, epoch, bytes);
        }
        if let Some(tick) = device_tick {
            uint64::encode(3, &tick.0, bytes);
        }
        for (tag, ns) in [(4, received.mono.ns()), (5, received.wall.ns())] {
            if ns != 0 {
                int64::encode(tag, &ns, bytes);
            }
        }
        float::encode_packed(6, counts, bytes);
        for (tag, number) in [(7, flags.0), (8, *lost_before)] {
            if number != 0 {
                uint32::encode(tag, &number, bytes);
            }
        }
        if *simulated {
            bool::encode(9, simulated, bytes);
        }
        uint32::encode_packed(10, bad_elements, bytes);
        if let Some(temperature_c) = temperature_c {
            float::encode(11, temperature_c, bytes);
        }
    }
}

impl From<&Frame> for pb::Frame {
    fn from(frame: &Frame) -> Self {
        Self {
            seq: frame.seq,
            epoch: frame.epoch,
            device_tick: frame.device_tick.map(|tick| tick.0),
            t_mono_ns: frame.received.mono.ns(),
            t_wall_ns: frame.received.wall.ns(),
            counts: frame.counts.to_vec(),
            flags: frame.flags.0,
            lost_before: frame.lost_before,
            simulated: frame.simulated,
            bad_elements: frame.bad_elements.to_vec(),
            temperature_c: frame.temperature_c,
        }
    }
}

impl From<pb::Frame> for Frame {
    fn from(message: pb::Frame) -> Self {
        Self {
            seq: message.seq,
            epoch: message.epoch,
            device_tick: message.device_tick.map(DeviceTick),
            received: TimeStamp {
                mono: MonoTime::from_ns(message.t_mono_ns),
                wall: WallTime::from_ns(message.t_wall_ns),
            },
            counts: message.counts.into(),
            flags: FrameFlags(message.flags),
            lost_before: message.lost_before,
            simulated: message.simulated,
            bad_elements: message.bad_elements.into(),
            temperature_c: message.temperature_c,
        }
    }
}

#[cfg(test)]
#[path = "frame_tests.rs"]
mod tests;
