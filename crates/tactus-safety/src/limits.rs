//! The rig's limits, and whether a target lies within them.

use tactus_schema::rig::{Envelope, Motion, Service};
use tactus_schema::{MonoTime, Rig};

use crate::{Denied, Target};

/// Longest step down near the covering. The next step is permitted only after the last is confirmed, so that a host that
/// dies leaves the tip at most this far below its last confirmed height.
pub const STEP_DOWN_MAX_MM: f64 = 0.1;

/// Heights that differ by less count as equal: a third of the stage's vertical step.
pub const SAME_HEIGHT_MM: f64 = 0.0003;

/// Sample periods without a frame after which a tip near the covering is stopped.
const SILENT_PERIODS_MAX: f64 = 3.0;

/// Greatest age of the report that a step down starts from. Drivers ask a standing stage every 0.1 s, and again 0.25 s after a question that
/// was not answered. Where a report of Grbl is missing, the next question waits for half a second, and a step for its answer.
pub(crate) const REPORT_AGE_MAX_S: f64 = 0.5;

/// Shortest of the supervisor's times. Links deliver in batches of up to 16 ms and timers are coarse: three periods of a sensor of
/// more than 100 Hz are no silence, and a question to the controller outlasts one period of more than 33 Hz.
const SHORTEST_S: f64 = 0.03;

/// What the supervisor holds motion and readings against.
#[derive(Debug, Clone)]
pub(crate) struct Limits {
    pub(crate) envelope: Envelope,
    pub(crate) motion: Motion,
    pub(crate) depth_max_mm: f64,
    pub(crate) sample_period_s: f64,
}

impl Limits {
    pub(crate) fn new(rig: &Rig, service: &Service) -> Self {
        Self {
            envelope: service.envelope.clone(),
            motion: service.motion,
            depth_max_mm: service.envelope.depth_max_mm(rig.covering),
            sample_period_s: 1.0 / rig.array.rate_hz(),
        }
    }

    /// Longest time without a frame near the covering.
    pub(crate) fn silence_max_s(&self) -> f64 {
        (SILENT_PERIODS_MAX * self.sample_period_s).max(SHORTEST_S)
    }

    /// How long a permit down is valid: a sample period, but not less than a driver takes to ask the controller before a move.
    pub(crate) fn permit_s(&self) -> f64 {
        self.sample_period_s.max(SHORTEST_S)
    }

    /// True at heights at which only small steps go down and silence counts.
    pub(crate) fn is_near(&self, z_mm: f64) -> bool {
        z_mm < self.motion.approach_height_mm
    }

    pub(crate) fn silence_s(now: MonoTime, last: Option<MonoTime>) -> f64 {
        last.map_or(f64::INFINITY, |last| now.since(last).as_secs_f64())
    }

    /// True if a move goes straight up, or nowhere.
    pub(crate) fn goes_up(&self, from_mm: [f64; 3], to: Target) -> bool {
        let [x_mm, y_mm, z_mm] = to.position_mm;
        let aside_mm = (x_mm - from_mm[0]).hypot(y_mm - from_mm[1]);
        aside_mm <= self.motion.tolerance_mm && z_mm >= from_mm[2] - SAME_HEIGHT_MM
    }

    /// Checks a way up.
    pub(crate) fn check_up(&self, from_mm: [f64; 3], to: Target) -> Result<(), Denied> {
        let greatest_mm = self.envelope.z_max_mm.max(from_mm[2]);
        check_axis("z", to.position_mm[2], [f64::NEG_INFINITY, greatest_mm])?;
        check_speed(to.speed_mm_per_s, self.envelope.speed_max_mm_per_s)
    }

    /// Checks a way sideways or down.
    pub(crate) fn check_way(&self, from_mm: [f64; 3], to: Target) -> Result<(), Denied> {
        let (envelope, motion) = (&self.envelope, &self.motion);
        let [x_mm, y_mm, z_mm] = to.position_mm;
        check_axis("x", x_mm, envelope.x_mm)?;
        check_axis("y", y_mm, envelope.y_mm)?;
        check_axis("z", z_mm, [f64::NEG_INFINITY, envelope.z_max_mm])?;
        if -z_mm > self.depth_max_mm + SAME_HEIGHT_MM {
            return Err(Denied::TooDeep { depth_mm: -z_mm, limit_mm: self.depth_max_mm });
        }
        let near_mm = motion.approach_height_mm;
        let is_deep = z_mm < near_mm - SAME_HEIGHT_MM;
        let lowest_mm = z_mm.min(from_mm[2]);
        let aside_mm = (x_mm - from_mm[0]).hypot(y_mm - from_mm[1]);
        if aside_mm > motion.tolerance_mm && lowest_mm < near_mm - motion.tolerance_mm {
            return Err(Denied::Sideways { z_mm: lowest_mm, limit_mm: near_mm });
        }
        let step_mm = from_mm[2] - z_mm;
        if is_deep && step_mm > STEP_DOWN_MAX_MM + 1e-6 {
            return Err(Denied::TooFarDown { step_mm, limit_mm: STEP_DOWN_MAX_MM });
        }
        // Below the safe height a damaged command must not carry the tip far before a report shows it.
        let is_low = z_mm < motion.safe_height_mm - motion.tolerance_mm;
        let limit_mm_per_s = if is_low && step_mm > SAME_HEIGHT_MM {
            envelope.load_speed_max_mm_per_s
        } else {
            envelope.speed_max_mm_per_s
        };
        check_speed(to.speed_mm_per_s, limit_mm_per_s)
    }
}

/// NaN is outside all bounds.
fn check_axis(axis: &'static str, value_mm: f64, [least_mm, greatest_mm]: [f64; 2]) -> Result<(), Denied> {
    if value_mm >= least_mm - 1e-9 && value_mm <= greatest_mm + 1e-9 {
        Ok(())
    } else {
        Err(Denied::Outside { axis, value_mm, least_mm, greatest_mm })
    }
}

fn check_speed(speed_mm_per_s: f64, limit_mm_per_s: f64) -> Result<(), Denied> {
    if speed_mm_per_s > 0.0 && speed_mm_per_s <= limit_mm_per_s {
        Ok(())
    } else {
        Err(Denied::TooFast { speed_mm_per_s, limit_mm_per_s })
    }
}
