//! What the sensor goes through, moment by moment: the covariates on which what nobody has named may depend.
//!
//! Discovery looks for a dependence of the residual on these, and a drafted effect ([`crate::effect::Draft`]) is a function of one or two of
//! them. Both take them from here, so that a draft means in a simulation what it meant in the data.

use crate::Array;

/// A slower move counts as none, in mm/s.
const STILL_MM_PER_S: f64 = 0.03;
/// A slower sideways move has no direction, in mm/s.
const ASIDE_MM_PER_S: f64 = 1.5;
/// Least time between two moments for a speed.
const LEAST_S: f64 = 1e-6;

/// The history of a sensor up to a moment; sensor frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// Time of the last moment, since the start.
    pub t_s: f64,
    /// Place of the tip.
    pub position_mm: [f64; 2],
    /// Depth of the tip below the surface; negative above it.
    pub depth_mm: f64,
    /// When the tip last touched the covering: 0 before the first contact.
    pub contact_s: f64,
    /// When it last left it.
    pub release_s: Option<f64>,
    /// When it last started or stopped.
    pub turn_s: f64,
    /// True if its last move along z was up.
    pub is_upward: bool,
    /// Speed of its last move along z in contact.
    pub speed_mm_per_s: f64,
    /// Speed of the tip.
    pub travel_mm_per_s: f64,
    /// Its way so far.
    pub travel_mm: f64,
    /// Direction of the last sideways move along x and y: -1, 0 or 1.
    pub aside: [f64; 2],
    /// Direction of the last sideways move as a vector of length 1; 0 before the first.
    pub heading: [f64; 2],
    /// Number of contacts so far.
    pub presses: f64,
    /// Largest depth in earlier contacts.
    pub deepest_before_mm: f64,
    /// The last place that was pressed.
    pub last_place_mm: Option<[f64; 2]>,
    /// Temperature of the sensor, where it is known.
    pub temperature_c: Option<f64>,
    deepest_mm: f64,
    is_moving: bool,
    has_begun: bool,
}

/// A covariate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "its name says it")]
pub enum Covariate {
    Time,
    SinceContact,
    SinceRelease,
    SinceTurn,
    Depth,
    Height,
    DeepestBefore,
    Direction,
    ApproachX,
    ApproachY,
    Speed,
    TravelSpeed,
    Travel,
    Press,
    PlaceX,
    PlaceY,
    InElementX,
    InElementY,
    Temperature,
    SumOfSignals,
    Signal,
    ShareOfLargest,
    Distance,
    Ahead,
    Counts,
}

/// A moment as an element sees it: what all covariates are functions of.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The history.
    pub trace: &'a Trace,
    /// The array.
    pub array: &'a Array,
    /// Signals of all elements, in mm; empty where they are not known yet.
    pub signal_mm: &'a [f64],
    /// Counts of all elements; empty where they are not known yet.
    pub counts: &'a [f64],
}

impl Trace {
    /// Takes the next moment.
    pub fn take(&mut self, t_s: f64, position_mm: [f64; 2], depth_mm: f64, temperature_c: Option<f64>) {
        if self.has_begun {
            self.move_to(t_s, position_mm, depth_mm);
        }
        let touched = self.has_begun && self.depth_mm > 0.0;
        if depth_mm > 0.0 {
            if !touched {
                self.contact_s = t_s;
                self.presses += 1.0;
                self.deepest_before_mm = self.deepest_mm;
            }
            self.deepest_mm = self.deepest_mm.max(depth_mm);
            self.last_place_mm = Some(position_mm);
        } else if touched {
            self.release_s = Some(t_s);
        }
        self.has_begun = true;
        self.t_s = t_s;
        self.position_mm = position_mm;
        self.depth_mm = depth_mm;
        self.temperature_c = temperature_c;
    }

    fn move_to(&mut self, t_s: f64, position_mm: [f64; 2], depth_mm: f64) {
        let dt_s = t_s - self.t_s;
        if dt_s < LEAST_S {
            return;
        }
        let fell_mm = depth_mm - self.depth_mm;
        if fell_mm.abs() > STILL_MM_PER_S * dt_s {
            self.is_upward = fell_mm < 0.0;
            if depth_mm > 0.0 {
                self.speed_mm_per_s = fell_mm.abs() / dt_s;
            }
        }
        let aside: [f64; 2] = std::array::from_fn(|axis| position_mm[axis] - self.position_mm[axis]);
        let along_mm = aside[0].hypot(aside[1]);
        let moved_mm = along_mm.max(fell_mm.abs());
        self.travel_mm_per_s = moved_mm / dt_s;
        self.travel_mm += along_mm.hypot(fell_mm);
        let is_moving = moved_mm > STILL_MM_PER_S * dt_s;
        if self.is_moving != is_moving {
            (self.is_moving, self.turn_s) = (is_moving, t_s);
        }
        if along_mm > ASIDE_MM_PER_S * dt_s {
            self.heading = aside.map(|moved| moved / along_mm);
        }
        for (held, moved) in self.aside.iter_mut().zip(aside) {
            if moved.abs() > ASIDE_MM_PER_S * dt_s {
                *held = moved.signum();
            }
        }
    }
}

impl Covariate {
    /// All of them.
    pub const ALL: [Self; 25] = [
        Self::Time,
        Self::SinceContact,
        Self::SinceRelease,
        Self::SinceTurn,
        Self::Depth,
        Self::Height,
        Self::DeepestBefore,
        Self::Direction,
        Self::ApproachX,
        Self::ApproachY,
        Self::Speed,
        Self::TravelSpeed,
        Self::Travel,
        Self::Press,
        Self::PlaceX,
        Self::PlaceY,
        Self::InElementX,
        Self::InElementY,
        Self::Temperature,
        Self::SumOfSignals,
        Self::Signal,
        Self::ShareOfLargest,
        Self::Distance,
        Self::Ahead,
        Self::Counts,
    ];

    /// The name in reports and drafts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::SinceContact => "time since contact",
            Self::SinceRelease => "time since release",
            Self::SinceTurn => "time since a start or stop",
            Self::Depth => "depth",
            Self::Height => "height above the surface",
            Self::DeepestBefore => "largest past depth",
            Self::Direction => "direction of motion",
            Self::ApproachX => "direction of approach along x",
            Self::ApproachY => "direction of approach along y",
            Self::Speed => "speed",
            Self::TravelSpeed => "speed of travel",
            Self::Travel => "travel",
            Self::Press => "press",
            Self::PlaceX => "place along x",
            Self::PlaceY => "place along y",
            Self::InElementX => "place in the element along x",
            Self::InElementY => "place in the element along y",
            Self::Temperature => "temperature",
            Self::SumOfSignals => "sum of signals",
            Self::Signal => "signal",
            Self::ShareOfLargest => "share of the largest signal",
            Self::Distance => "distance from the tip",
            Self::Ahead => "distance along the approach",
            Self::Counts => "counts",
        }
    }

    /// Its unit; empty for a number without one.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Time | Self::SinceContact | Self::SinceRelease | Self::SinceTurn => "s",
            Self::Speed | Self::TravelSpeed => "mm/s",
            Self::Temperature => "C",
            Self::Counts => "counts",
            Self::Direction | Self::ApproachX | Self::ApproachY | Self::Press | Self::ShareOfLargest => "",
            Self::Depth
            | Self::Height
            | Self::DeepestBefore
            | Self::Travel
            | Self::PlaceX
            | Self::PlaceY
            | Self::InElementX
            | Self::InElementY
            | Self::SumOfSignals
            | Self::Signal
            | Self::Distance
            | Self::Ahead => "mm",
        }
    }

    /// The covariate of a name.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|known| known.name() == name)
    }

    /// True if it differs from element to element.
    pub const fn is_of_element(self) -> bool {
        matches!(self, Self::Signal | Self::ShareOfLargest | Self::Distance | Self::Ahead | Self::Counts)
    }

    /// True if it is known only with the signals, or the counts.
    pub const fn needs_signals(self) -> bool {
        matches!(self, Self::SumOfSignals | Self::Signal | Self::ShareOfLargest | Self::Counts)
    }

    /// Its value for an element; `None` where there is none, such as the time since release before the first.
    pub fn value(self, seen: Seen<'_>, element: usize) -> Option<f64> {
        let trace = seen.trace;
        let signal = || seen.signal_mm.get(element).copied();
        Some(match self {
            Self::Time => trace.t_s,
            Self::SinceContact => trace.t_s - trace.contact_s,
            Self::SinceRelease => trace.t_s - trace.release_s?,
            Self::SinceTurn => trace.t_s - trace.turn_s,
            Self::Depth => trace.depth_mm,
            Self::Height => (-trace.depth_mm).max(0.0),
            Self::DeepestBefore => trace.deepest_before_mm,
            Self::Direction => f64::from(u8::from(trace.is_upward)),
            Self::ApproachX => trace.aside[0],
            Self::ApproachY => trace.aside[1],
            Self::Speed => trace.speed_mm_per_s,
            Self::TravelSpeed => trace.travel_mm_per_s,
            Self::Travel => trace.travel_mm,
            Self::Press => trace.presses,
            Self::PlaceX => trace.position_mm[0],
            Self::PlaceY => trace.position_mm[1],
            Self::InElementX => in_element(seen.array.col_centres_mm(), trace.position_mm[0]),
            Self::InElementY => in_element(seen.array.row_centres_mm(), trace.position_mm[1]),
            Self::Temperature => trace.temperature_c?,
            Self::SumOfSignals => seen.signal_mm.iter().sum(),
            Self::Signal => signal()?,
            Self::ShareOfLargest => {
                let largest = seen.signal_mm.iter().copied().fold(0.0, f64::max);
                signal()? / largest.max(f64::MIN_POSITIVE)
            }
            Self::Distance => {
                let [x, y] = seen.offset_mm(element)?;
                x.hypot(y)
            }
            Self::Ahead => {
                let ([x, y], [along_x, along_y]) = (seen.offset_mm(element)?, trace.heading);
                x * along_x + y * along_y
            }
            Self::Counts => *seen.counts.get(element)?,
        })
    }
}

impl Seen<'_> {
    /// From the tip to an element's centre.
    fn offset_mm(self, element: usize) -> Option<[f64; 2]> {
        let centre = self.array.centre_mm(element)?;
        Some(std::array::from_fn(|axis| centre[axis] - self.trace.position_mm[axis]))
    }
}

/// How far a place is from the nearest centre.
fn in_element(centres_mm: &[f64], place_mm: f64) -> f64 {
    let from = centres_mm.iter().map(|centre| place_mm - centre);
    from.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
}

#[cfg(test)]
#[path = "trace_tests.rs"]
mod tests;
