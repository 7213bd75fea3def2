//! From a line to an [`InjectedFault`].

use std::str::{FromStr, SplitWhitespace};
use std::time::Duration;

use super::{
    CableFault, ControllerFault, InjectedFault, LinkDirection, LinkFault, RigFault, SensorFault, StageFault,
    WireFault,
};

const SENSOR_FAULTS: &str = "burst N, clear, clock-drift PPM, clock-jump DURATION, clock-wrap, disconnect DURATION, drip DURATION, drop BYTES, \
     drop-frames N, duplicate, flip-bits N, freeze DURATION, garbage BYTES, renumber, reorder, saturate ELEMENT, \
     stall DURATION, stuck ELEMENT, truncate, wrong-checksum, wrong-count N, zeros COUNTS";
const STAGE_FAULTS: &str = "alarm N, clear, disconnect DURATION, echo-garbage, homing-fails, ignore-moves, lie MM, \
     lost-steps MM, never-idle, refuse [ERROR], renumber, reset, stall DURATION, work-offset MM";
const WIRE_FAULTS: &str = "double BYTES, drip DURATION, drop BYTES, flip-bits N, garbage BYTES, hold DURATION, lose DURATION, \
     reorder, repeat, truncate";
const RIG_FAULTS: &str = "covering MM, stiffness FACTOR, surface MM";

/// The default error of `refuse`: an invalid target.
const REFUSAL: u8 = 33;

/// The longest frame, garbage or drop that makes sense as an argument.
const MAX_COUNT: usize = 32_000;

/// Why a line is not a fault that this rig can have.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum FaultError {
    /// The line does not begin with a device.
    #[error(
        "{found:?} is no device; there is: sensor, stage, rig, to-sensor, from-sensor, to-stage, from-stage"
    )]
    Device { found: String },
    /// The device has no such fault.
    #[error("the {device} has no fault {found:?}; there is: {known}")]
    Unknown { device: &'static str, found: String, known: &'static str },
    /// An argument is missing.
    #[error("{fault} needs {wanted}")]
    Missing { fault: String, wanted: &'static str },
    /// An argument is not what it should be.
    #[error("{fault} needs {wanted}, not {found:?}")]
    Argument { fault: String, wanted: &'static str, found: String },
    /// There is more than the fault takes.
    #[error("{fault} takes nothing more, but {found:?} follows")]
    TooMuch { fault: String, found: String },
    /// The array has no such element.
    #[error("element {element}: elements are 0 to {last}")]
    Element { element: usize, last: usize },
    /// The device has too many faults waiting, or has ended.
    #[error("the device does not take faults at present: it has ended, or dozens are waiting")]
    NotTaken,
}

impl FromStr for InjectedFault {
    type Err = FaultError;

    fn from_str(line: &str) -> Result<Self, FaultError> {
        let mut words = line.split_whitespace();
        let device = words.next().unwrap_or_default();
        let mut arguments = Arguments { fault: words.next().unwrap_or_default(), words };
        let fault = match device {
            "sensor" => match cable(&mut arguments)? {
                Some(fault) => Self::SensorCable(fault),
                None => Self::Sensor(sensor(&mut arguments)?),
            },
            "stage" => match cable(&mut arguments)? {
                Some(fault) => Self::StageCable(fault),
                None => Self::Stage(stage(&mut arguments)?),
            },
            "to-sensor" => Self::Sensor(SensorFault::Wire(LinkDirection::FromHost, wire(&mut arguments)?)),
            "from-sensor" => {
                Self::Sensor(SensorFault::Wire(LinkDirection::FromDevice, wire(&mut arguments)?))
            }
            "to-stage" => Self::Stage(StageFault::Wire(LinkDirection::FromHost, wire(&mut arguments)?)),
            "from-stage" => Self::Stage(StageFault::Wire(LinkDirection::FromDevice, wire(&mut arguments)?)),
            "rig" => Self::Rig(rig(&mut arguments)?),
            found => return Err(FaultError::Device { found: found.to_owned() }),
        };
        arguments.end()?;
        Ok(fault)
    }
}

fn cable(arguments: &mut Arguments<'_>) -> Result<Option<CableFault>, FaultError> {
    Ok(match arguments.fault {
        "disconnect" => Some(CableFault::Disconnect(arguments.duration()?)),
        "renumber" => Some(CableFault::Renumber),
        _ => None,
    })
}

fn sensor(arguments: &mut Arguments<'_>) -> Result<SensorFault, FaultError> {
    Ok(match arguments.fault {
        "clock-jump" => SensorFault::ClockJump { ms: arguments.signed_ms()? },
        "clock-wrap" => SensorFault::ClockWrap,
        "clock-drift" => SensorFault::ClockDrift { ppm: arguments.drift()? },
        "stuck" => SensorFault::Stuck(arguments.count()?),
        "saturate" => SensorFault::Saturate(arguments.count()?),
        "freeze" => SensorFault::Freeze(arguments.duration()?),
        "zeros" => SensorFault::Zeros(u16::try_from(arguments.count()?).unwrap_or(u16::MAX)),
        "clear" => SensorFault::Clear,
        _ => SensorFault::Link(link(arguments)?),
    })
}

fn wire(arguments: &mut Arguments<'_>) -> Result<WireFault, FaultError> {
    Ok(match arguments.fault {
        "lose" => WireFault::Lose(arguments.duration()?),
        "hold" => WireFault::Hold(arguments.duration()?),
        "drip" => WireFault::Drip(arguments.duration()?),
        "drop" => WireFault::Drop(arguments.count()?),
        "flip-bits" => WireFault::FlipBits(arguments.count()?),
        "double" => WireFault::Double(arguments.count()?),
        "garbage" => WireFault::Garbage(arguments.count()?),
        "repeat" => WireFault::Repeat,
        "truncate" => WireFault::Truncate,
        "reorder" => WireFault::Reorder,
        _ => return Err(arguments.unknown("link", WIRE_FAULTS)),
    })
}

fn link(arguments: &mut Arguments<'_>) -> Result<LinkFault, FaultError> {
    Ok(match arguments.fault {
        "stall" => LinkFault::Stall(arguments.duration()?),
        "drip" => LinkFault::Drip(arguments.duration()?),
        "drop" => LinkFault::Drop(arguments.count()?),
        "drop-frames" => LinkFault::DropFrames(arguments.count()?),
        "flip-bits" => LinkFault::FlipBits(arguments.count()?),
        "garbage" => LinkFault::Garbage(arguments.count()?),
        "duplicate" => LinkFault::Duplicate,
        "reorder" => LinkFault::Reorder,
        "wrong-checksum" => LinkFault::WrongChecksum,
        "truncate" => LinkFault::Truncate,
        "burst" => LinkFault::Burst(arguments.count()?),
        "wrong-count" => LinkFault::WrongCount(arguments.count()?),
        _ => return Err(arguments.unknown("sensor", SENSOR_FAULTS)),
    })
}

fn stage(arguments: &mut Arguments<'_>) -> Result<StageFault, FaultError> {
    Ok(match arguments.fault {
        "echo-garbage" => StageFault::EchoGarbage,
        "stall" => StageFault::Stall(arguments.duration()?),
        "clear" => StageFault::Clear,
        _ => StageFault::Controller(controller(arguments)?),
    })
}

fn controller(arguments: &mut Arguments<'_>) -> Result<ControllerFault, FaultError> {
    Ok(match arguments.fault {
        "alarm" => ControllerFault::Alarm(arguments.code()?),
        "lie" => ControllerFault::Lie { z_mm: arguments.number("a length in mm")? },
        "never-idle" => ControllerFault::NeverIdle,
        "refuse" if arguments.is_empty() => ControllerFault::Refuse(REFUSAL),
        "refuse" => ControllerFault::Refuse(arguments.code()?),
        "ignore-moves" => ControllerFault::IgnoreMoves,
        "reset" => ControllerFault::Reset,
        "lost-steps" => {
            ControllerFault::LostSteps { lost_mm: arguments.positive("a positive length in mm")? }
        }
        "homing-fails" => ControllerFault::HomingFails,
        "work-offset" => ControllerFault::WorkOffset { mm: arguments.number("a length in mm")? },
        _ => return Err(arguments.unknown("stage", STAGE_FAULTS)),
    })
}

fn rig(arguments: &mut Arguments<'_>) -> Result<RigFault, FaultError> {
    Ok(match arguments.fault {
        "covering" => RigFault::Covering { thickness_mm: arguments.positive("a positive thickness in mm")? },
        "surface" => RigFault::Surface { z_mm: arguments.number("a height in mm")? },
        "stiffness" => RigFault::Stiffness(arguments.positive("a positive factor")?),
        _ => return Err(arguments.unknown("rig", RIG_FAULTS)),
    })
}

/// The words after a fault's name.
struct Arguments<'a> {
    fault: &'a str,
    words: SplitWhitespace<'a>,
}

impl Arguments<'_> {
    fn is_empty(&self) -> bool {
        self.words.clone().next().is_none()
    }

    fn duration(&mut self) -> Result<Duration, FaultError> {
        self.argument("a duration such as 2s or 500ms", duration)
    }

    #[expect(clippy::cast_possible_truncation, reason = "within a year")]
    fn signed_ms(&mut self) -> Result<i64, FaultError> {
        self.argument("a duration such as 2s or -500ms", |word| {
            let ms = milliseconds(word)?;
            (-MAX_MS..=MAX_MS).contains(&ms).then_some(ms as i64)
        })
    }

    fn drift(&mut self) -> Result<i16, FaultError> {
        self.argument("a number from -1000 to 1000", |word| {
            word.parse().ok().filter(|ppm| (-1000..=1000).contains(ppm))
        })
    }

    fn count(&mut self) -> Result<usize, FaultError> {
        self.argument("a number from 0 to 32000", |word| {
            word.parse().ok().filter(|count| *count <= MAX_COUNT)
        })
    }

    fn code(&mut self) -> Result<u8, FaultError> {
        self.argument("a number from 1 to 99", |word| {
            word.parse().ok().filter(|code| (1..=99).contains(code))
        })
    }

    fn number(&mut self, wanted: &'static str) -> Result<f64, FaultError> {
        self.argument(wanted, |word| word.parse().ok().filter(|number: &f64| number.is_finite()))
    }

    fn positive(&mut self, wanted: &'static str) -> Result<f64, FaultError> {
        self.argument(wanted, |word| {
            word.parse().ok().filter(|number: &f64| number.is_finite() && *number > 0.0)
        })
    }

    fn argument<T>(
        &mut self,
        wanted: &'static str,
        read: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, FaultError> {
        let fault = self.fault.to_owned();
        match self.words.next() {
            None => Err(FaultError::Missing { fault, wanted }),
            Some(word) => {
                read(word).ok_or_else(|| FaultError::Argument { fault, wanted, found: word.to_owned() })
            }
        }
    }

    fn end(mut self) -> Result<(), FaultError> {
        match self.words.next() {
            None => Ok(()),
            Some(word) => Err(FaultError::TooMuch { fault: self.fault.to_owned(), found: word.to_owned() }),
        }
    }

    fn unknown(&self, device: &'static str, known: &'static str) -> FaultError {
        FaultError::Unknown { device, found: self.fault.to_owned(), known }
    }
}

/// Parses a duration with its unit, such as `2s` or `500ms`; at most a year.
pub fn duration(word: &str) -> Option<Duration> {
    let ms = milliseconds(word)?;
    (0.0..=MAX_MS).contains(&ms).then(|| Duration::from_secs_f64(ms / 1000.0))
}

/// A year.
const MAX_MS: f64 = 365.0 * 86_400_000.0;

fn milliseconds(word: &str) -> Option<f64> {
    let (number, unit_ms) = match word.strip_suffix("ms") {
        Some(number) => (number, 1.0),
        None => (word.strip_suffix('s')?, 1000.0),
    };
    number.parse::<f64>().ok().map(|number| number * unit_ms)
}

#[cfg(test)]
#[path = "parse_tests.rs"]
mod tests;
