//! Faults that the virtual devices can be told to have, as text and typed.
//!
//! One line is one fault: the device, the fault's name, its arguments. Durations carry their unit
//! (`2s`, `500ms`), lengths are in mm. Faults that last go on until `sensor clear` or `stage clear`.

mod parse;
mod script;

use std::time::Duration;

pub use parse::FaultError;
pub use parse::duration;
pub use script::{FaultScript, FaultScriptError, TimedFault};

/// Something that goes wrong, or that is changed behind the service's back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// In the sensor, or between it and the host.
    Sensor(SensorFault),
    /// With the sensor's cable, which also powers it.
    SensorCable(CableFault),
    /// In the stage's controller, or between it and the host.
    Stage(StageFault),
    /// With the stage's cable; the controller has a supply of its own, and motion goes on.
    StageCable(CableFault),
    /// In the world between them.
    Rig(RigFault),
}

/// Faults of a cable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CableFault {
    /// `disconnect 2s`: unplugged, and plugged in again after a while.
    Disconnect(Duration),
    /// `renumber`: unplugged and plugged in again at once; a pseudo-terminal gets another number.
    Renumber,
}

/// Faults of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SensorFault {
    /// On the way from the controller to the host.
    Link(LinkFault),
    /// `clock-jump -500ms`: the device's clock jumps, in ms.
    ClockJump {
        /// By how much; negative is back.
        ms: i64,
    },
    /// `clock-wrap`: the device's clock comes to within a second of its overflow.
    ClockWrap,
    /// `stuck 7`: the element goes on reading what it reads now.
    Stuck(usize),
    /// `saturate 7`: the element reads full scale.
    Saturate(usize),
    /// `clear`: ends the faults that last.
    Clear,
}

/// What happens to frames on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinkFault {
    /// `stall 2s`: says nothing for a while; what it measures meanwhile is lost.
    Stall(Duration),
    /// `drip 5s`: for a while bytes come one at a time, evenly spaced.
    Drip(Duration),
    /// `drop 5`: the next bytes are lost.
    Drop(usize),
    /// `drop-frames 5`: the next frames are lost.
    DropFrames(usize),
    /// `flip-bits 3`: bits of the next frame arrive flipped.
    FlipBits(usize),
    /// `garbage 64`: random bytes before the next frame.
    Garbage(usize),
    /// `duplicate`: the next frame comes twice.
    Duplicate,
    /// `reorder`: the next frame comes after the one that follows it.
    Reorder,
    /// `wrong-checksum`: the next frame's checksum does not hold.
    WrongChecksum,
    /// `truncate`: the next frame breaks off in its middle.
    Truncate,
    /// `burst 10`: the next frames come all at once, when the last of them is taken.
    Burst(usize),
    /// `wrong-count 47`: the next frame has this many elements.
    WrongCount(usize),
}

/// Faults of the stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StageFault {
    /// In what the controller does.
    Controller(ControllerFault),
    /// `echo-garbage`: sends every line back, with garbage behind it.
    EchoGarbage,
    /// `stall 2s`: the controller neither listens nor speaks for a while; motion goes on.
    Stall(Duration),
    /// `clear`: ends the faults that last.
    Clear,
}

/// What a stage's controller does wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ControllerFault {
    /// `alarm 1`: stops dead and raises an alarm. Zaber's faults have letters: there z stalls, whatever the number.
    Alarm(u8),
    /// `lie 0.05`: reports a z this much too high, in mm.
    Lie {
        /// Added to the reported z.
        z_mm: f64,
    },
    /// `never-idle`: reports that it moves, for ever.
    NeverIdle,
    /// `refuse` or `refuse 33`: answers the next move with an error and does not move.
    Refuse(u8),
    /// `ignore-moves`: accepts moves and does none.
    IgnoreMoves,
    /// `reset`: restarts as after a power failure, and no longer knows where it is.
    Reset,
    /// `lost-steps 0.05`: the next move falls short by this much, unnoticed, in mm.
    LostSteps {
        /// Way lost at the beginning of the move.
        lost_mm: f64,
    },
    /// `homing-fails`: the next homing finds no switch.
    HomingFails,
}

/// Changes of the world that the service is not told of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RigFault {
    /// `covering 2.54`: another covering, in mm.
    Covering {
        /// Its thickness.
        thickness_mm: f64,
    },
    /// `surface 0.1`: the true surface stands here, where the service believes 0, in mm.
    Surface {
        /// Its height.
        z_mm: f64,
    },
    /// `stiffness 3`: the covering answers this many times as strongly.
    Stiffness(f64),
}
