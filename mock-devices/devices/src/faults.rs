//! Faults that can be injected into the virtual devices, as text and as types.
//!
//! One line is one fault: the device, the fault's name, its arguments. Durations carry their unit
//! (`2s`, `500ms`), lengths are in mm. Lasting faults end with `sensor clear` or `stage clear`.

mod parse;
mod script;

use std::time::Duration;

pub use parse::FaultError;
pub use parse::duration;
pub use script::{FaultScript, FaultScriptError, TimedFault};

/// A fault to inject, or a change that is hidden from the service.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InjectedFault {
    /// In the sensor, or between it and the host.
    Sensor(SensorFault),
    /// Of the sensor's cable, which also powers the sensor.
    SensorCable(CableFault),
    /// In the stage's controller, or between it and the host.
    Stage(StageFault),
    /// Of the stage's cable. The controller has its own supply, and motion continues.
    StageCable(CableFault),
    /// In the world that both devices share.
    Rig(RigFault),
}

/// Faults of a cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CableFault {
    /// `disconnect 2s`: unplugged, and plugged in again after this time.
    Disconnect(Duration),
    /// `renumber`: unplugged and plugged in again at once; a pseudo-terminal gets another number.
    Renumber,
}

/// Direction of bytes on a device's link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkDirection {
    /// `to-stage`, `to-sensor`: what the host sends.
    FromHost,
    /// `from-stage`, `from-sensor`: what the device sends.
    FromDevice,
}

/// Faults of the bytes in one direction of a link. A chunk is what is sent at once: a line, a frame, a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WireFault {
    /// `lose 2s`: what is sent in this time is lost.
    Lose(Duration),
    /// `hold 2s`: what is sent in this time arrives all at once at its end.
    Hold(Duration),
    /// `drip 2s`: what is sent in this time arrives one byte at a time, a millisecond each.
    Drip(Duration),
    /// `drop 3`: the next bytes are lost.
    Drop(usize),
    /// `flip-bits 1`: this many random bits of the next chunk are flipped.
    FlipBits(usize),
    /// `double 1`: this many random bytes of the next chunk come twice.
    Double(usize),
    /// `garbage 8`: random bytes before the next chunk.
    Garbage(usize),
    /// `repeat`: the next chunk comes twice.
    Repeat,
    /// `truncate`: the next chunk ends in its middle.
    Truncate,
    /// `reorder`: the next chunk comes after the one that follows it.
    Reorder,
}

/// Faults of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFault {
    /// Between the controller and the host.
    Link(LinkFault),
    /// `clock-jump -500ms`: the device's clock jumps, in ms.
    ClockJump {
        /// Negative is backwards.
        ms: i64,
    },
    /// `clock-wrap`: the device's clock comes to within a second of its overflow.
    ClockWrap,
    /// `clock-drift 50`: from now on the device's clock and its samplings run fast by this many millionths, at most 1000.
    ClockDrift {
        /// Negative is slow.
        ppm: i16,
    },
    /// `stuck 7`: the element keeps its present reading.
    Stuck(usize),
    /// `saturate 7`: the element reads full scale.
    Saturate(usize),
    /// `freeze 2s`: the same reading again and again for this time, with clock and counters going on.
    Freeze(Duration),
    /// `zeros 60`: from the next time it is plugged in, every reading is higher by this many counts.
    Zeros(u16),
    /// Of the bytes on its link.
    Wire(LinkDirection, WireFault),
    /// `clear`: ends lasting faults.
    Clear,
}

/// Faults of frames between the sensor's controller and the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkFault {
    /// `stall 2s`: sends nothing for this time; the frames of this time are lost.
    Stall(Duration),
    /// `drip 5s`: for this time bytes come one at a time, evenly spaced.
    Drip(Duration),
    /// `drop 5`: the next bytes are lost.
    Drop(usize),
    /// `drop-frames 5`: the next frames are lost.
    DropFrames(usize),
    /// `flip-bits 3`: this many random bits of the next frame are flipped.
    FlipBits(usize),
    /// `garbage 64`: random bytes before the next frame.
    Garbage(usize),
    /// `duplicate`: the next frame comes twice.
    Duplicate,
    /// `reorder`: the next frame comes after the one that follows it.
    Reorder,
    /// `wrong-checksum`: the next frame has a wrong checksum.
    WrongChecksum,
    /// `truncate`: the next frame ends in its middle.
    Truncate,
    /// `burst 10`: the next frames come all at once, when the last of them is sampled.
    Burst(usize),
    /// `wrong-count 47`: the next frame has this many elements.
    WrongCount(usize),
}

/// Faults of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StageFault {
    /// In the controller's behaviour.
    Controller(ControllerFault),
    /// `echo-garbage`: sends every line back, followed by garbage.
    EchoGarbage,
    /// Of the bytes on its link.
    Wire(LinkDirection, WireFault),
    /// `stall 2s`: the controller neither receives nor sends for this time; motion continues.
    Stall(Duration),
    /// `clear`: ends lasting faults.
    Clear,
}

/// Faults of a stage's controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControllerFault {
    /// `alarm 1`: stops at once and raises an alarm of this number. Zaber has no such numbers: there z stalls.
    Alarm(u8),
    /// `lie 0.05`: reports a z this much too high, in mm.
    Lie {
        /// Added to the reported z.
        z_mm: f64,
    },
    /// `never-idle`: always reports that it moves.
    NeverIdle,
    /// `refuse` or `refuse 33`: answers the next move with an error and does not move.
    Refuse(u8),
    /// `ignore-moves`: accepts moves, but makes none.
    IgnoreMoves,
    /// `reset`: restarts as after a power failure, and no longer knows its position.
    Reset,
    /// `lost-steps 0.05`: the next move falls short by this much, unnoticed, in mm.
    LostSteps {
        /// Distance lost at the beginning of the move.
        lost_mm: f64,
    },
    /// `work-offset -2`: somebody has set the work frame's origin to this machine coordinate of the axis that is the rig's z, in
    /// mm. It outlasts a reset. Zaber has no such frame.
    WorkOffset {
        /// Machine coordinate.
        mm: f64,
    },
    /// `homing-fails`: the next homing finds no switch.
    HomingFails,
}

/// Changes of the rig that are hidden from the service.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RigFault {
    /// `covering 2.54`: another covering, in mm.
    Covering {
        /// Its thickness.
        thickness_mm: f64,
    },
    /// `surface 0.1`: moves the true surface to this height, in mm; the service still believes 0.
    Surface {
        /// Height in the robot frame.
        z_mm: f64,
    },
    /// `stiffness 3`: multiplies the response of the covering.
    Stiffness(f64),
}
