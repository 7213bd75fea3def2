//! The status report: `<Run|MPos:4.716,2.828,-0.944|Bf:99,1023|FS:109,0>`.

use std::fmt;

/// The controller's answer to `?`. Fields that it omits are `None`; other fields are ignored.
#[derive(Debug, Clone, PartialEq)]
pub struct StatusReport {
    /// See [`MachineState`].
    pub state: MachineState,
    /// Its position, in one of two frames.
    pub position: Position,
    /// Origin of the work frame in the machine frame. Sent from time to time, and first after a reset.
    pub work_offset_mm: Option<[f64; 3]>,
    /// Free blocks of the planner, and free bytes of the line buffer.
    pub buffer: Option<[u32; 2]>,
    /// Present feed rate.
    pub feed_mm_per_min: Option<f64>,
}

/// State of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MachineState {
    /// Standing still, ready for lines.
    Idle,
    /// Executing a line.
    Run,
    /// Decelerating into a hold.
    Holding,
    /// Standing still in a hold (`Hold:0`).
    Hold,
    /// Executing a jog.
    Jog,
    /// Locked by an alarm. Only some firmware reports its number here.
    Alarm,
    /// The safety door is open.
    Door,
    /// Checking lines without moving.
    Check,
    /// Searching for the limit switches.
    Home,
    /// Asleep until reset.
    Sleep,
    /// Waiting for a tool change.
    Tool,
}

/// Position of the controller in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Position {
    /// `MPos`: machine frame.
    Machine([f64; 3]),
    /// `WPos`: work frame.
    Work([f64; 3]),
}

/// Why a line is not a status report.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StatusError {
    /// It is not enclosed in `<` `>`.
    #[error("a status report stands in angle brackets")]
    Brackets,
    /// An unknown state.
    #[error("there is no state {0:?}")]
    State(String),
    /// A field is malformed.
    #[error("the field {0:?} is malformed")]
    Field(String),
    /// Neither `MPos` nor `WPos`.
    #[error("the report tells no position")]
    NoPosition,
}

impl StatusReport {
    /// Parses a line.
    ///
    /// # Errors
    /// If it is not a complete report with a position.
    pub fn parse(line: &str) -> Result<Self, StatusError> {
        let inner =
            line.strip_prefix('<').and_then(|line| line.strip_suffix('>')).ok_or(StatusError::Brackets)?;
        let mut fields = inner.split('|');
        let state = fields.next().unwrap_or_default();
        let state = MachineState::parse(state).ok_or_else(|| StatusError::State(state.to_owned()))?;
        let (mut position, mut work_offset_mm, mut buffer, mut feed_mm_per_min) = (None, None, None, None);
        for field in fields {
            let malformed = || StatusError::Field(field.to_owned());
            let (name, value) = field.split_once(':').unwrap_or((field, ""));
            match name {
                "MPos" => position = Some(Position::Machine(triple(value).ok_or_else(malformed)?)),
                "WPos" => position = Some(Position::Work(triple(value).ok_or_else(malformed)?)),
                "WCO" => work_offset_mm = Some(triple(value).ok_or_else(malformed)?),
                "Bf" => buffer = Some(pair(value).ok_or_else(malformed)?),
                "FS" | "F" => {
                    let feed = value.split(',').next().and_then(number);
                    feed_mm_per_min = Some(feed.ok_or_else(malformed)?);
                }
                _ => {}
            }
        }
        let position = position.ok_or(StatusError::NoPosition)?;
        Ok(Self { state, position, work_offset_mm, buffer, feed_mm_per_min })
    }
}

impl fmt::Display for StatusReport {
    /// The report as Grbl prints it, with three decimals.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (name, [x, y, z]) = match self.position {
            Position::Machine(mm) => ("MPos", mm),
            Position::Work(mm) => ("WPos", mm),
        };
        write!(f, "<{}|{name}:{x:.3},{y:.3},{z:.3}", self.state)?;
        if let Some([blocks, bytes]) = self.buffer {
            write!(f, "|Bf:{blocks},{bytes}")?;
        }
        if let Some(feed) = self.feed_mm_per_min {
            write!(f, "|FS:{feed:.0},0")?;
        }
        if let Some([x, y, z]) = self.work_offset_mm {
            write!(f, "|WCO:{x:.3},{y:.3},{z:.3}")?;
        }
        f.write_str(">")
    }
}

impl MachineState {
    fn parse(text: &str) -> Option<Self> {
        let (name, substate) = text.split_once(':').map_or((text, None), |(name, sub)| (name, Some(sub)));
        Some(match name {
            "Idle" => Self::Idle,
            "Run" => Self::Run,
            "Hold" if substate == Some("0") => Self::Hold,
            "Hold" => Self::Holding,
            "Jog" => Self::Jog,
            "Alarm" => Self::Alarm,
            "Door" => Self::Door,
            "Check" => Self::Check,
            "Home" => Self::Home,
            "Sleep" => Self::Sleep,
            "Tool" => Self::Tool,
            _ => return None,
        })
    }
}

impl fmt::Display for MachineState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "Idle",
            Self::Run => "Run",
            Self::Holding => "Hold:1",
            Self::Hold => "Hold:0",
            Self::Jog => "Jog",
            Self::Alarm => "Alarm",
            Self::Door => "Door",
            Self::Check => "Check",
            Self::Home => "Home",
            Self::Sleep => "Sleep",
            Self::Tool => "Tool",
        })
    }
}

/// The first three of at least three numbers. Further axes are ignored.
pub(super) fn triple(text: &str) -> Option<[f64; 3]> {
    let mut numbers = text.split(',').map(number);
    Some([numbers.next()??, numbers.next()??, numbers.next()??])
}

fn pair(text: &str) -> Option<[u32; 2]> {
    let (first, second) = text.split_once(',')?;
    Some([first.parse().ok()?, second.parse().ok()?])
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
#[path = "status_tests.rs"]
mod tests;
