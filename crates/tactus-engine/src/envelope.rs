//! The bounds that no script may cross, checked before anything moves.

use tactus_model::Covering;
use tactus_plan::{Position, Press, Step};
use tactus_schema::Rig;
use tactus_schema::rig::{Envelope, Motion};

/// Longest time that one step may take: a day.
const DURATION_MAX_S: f64 = 86_400.0;

/// Thickest covering: four times the paper's thickest. The depth limit follows the thickness.
const THICKNESS_MAX_MM: f64 = 20.0;

/// The rig's envelope for the covering in place.
#[derive(Debug, Clone)]
pub struct Bounds {
    envelope: Envelope,
    motion: Motion,
    covering: Covering,
    registration: tactus_model::Registration,
}

/// A step that would leave the envelope. The message names the limit and the value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum Outside {
    /// Deeper than the covering allows.
    #[error(
        "{depth_mm} mm is too deep: the limit is {limit_mm:.3} mm ({share_percent:.0} % of the covering's {thickness_mm} mm; \
         envelope.depth_share_max)"
    )]
    Depth { depth_mm: f64, limit_mm: f64, share_percent: f64, thickness_mm: f64 },
    /// Beyond the travel that the rig allows.
    #[error(
        "{axis} = {value_mm:.3} mm (robot frame) is outside {least_mm} to {greatest_mm} mm (envelope.{axis}_mm)"
    )]
    Travel {
        /// x, y or z.
        axis: &'static str,
        value_mm: f64,
        least_mm: f64,
        greatest_mm: f64,
    },
    /// Longer than any step may last.
    #[error("{duration_s} s is too long for one step: the limit is {DURATION_MAX_S} s")]
    Duration { duration_s: f64 },
    /// The covering is thicker than 20 mm.
    #[error("no covering is {thickness_mm} mm thick: the limit is {THICKNESS_MAX_MM} mm")]
    Covering { thickness_mm: f64 },
    /// Faster than the rig allows.
    #[error("{speed_mm_per_s} mm/s is too fast: the limit is {limit_mm_per_s} mm/s (envelope.{limit})")]
    Speed {
        speed_mm_per_s: f64,
        limit_mm_per_s: f64,
        /// Name of the limit in the rig file.
        limit: &'static str,
    },
}

impl Bounds {
    /// The bounds of a rig that has a service part, for a covering.
    pub fn new(rig: &Rig, envelope: &Envelope, motion: &Motion, covering: Covering) -> Self {
        Self { envelope: envelope.clone(), motion: *motion, covering, registration: rig.registration }
    }

    /// The same bounds with another covering in place.
    #[must_use]
    pub fn under(mut self, covering: Covering) -> Self {
        self.covering = covering;
        self
    }

    /// Greatest depth, in mm.
    pub fn depth_max_mm(&self) -> f64 {
        self.envelope.depth_max_mm(self.covering)
    }

    /// Checks a step.
    ///
    /// # Errors
    /// [`Outside`] names the limit that the step would cross.
    pub fn check(&self, step: &Step) -> Result<(), Outside> {
        match step {
            Step::Move { to, height_mm, speed_mm_per_s } => {
                self.check_place(*to)?;
                check_axis(
                    "z",
                    height_mm.unwrap_or(self.motion.safe_height_mm),
                    [0.0, self.envelope.z_max_mm],
                )?;
                check_speed(*speed_mm_per_s, self.envelope.speed_max_mm_per_s, "speed_max_mm_per_s")
            }
            Step::Press(press) => self.check_press(press),
            Step::Dwell { duration_s }
            | Step::Read { duration_s }
            | Step::Tare { duration_s }
            | Step::Wait { duration_s } => check_duration(*duration_s),
            Step::Covering { thickness_mm }
                if !(*thickness_mm > 0.0 && *thickness_mm <= THICKNESS_MAX_MM) =>
            {
                Err(Outside::Covering { thickness_mm: *thickness_mm })
            }
            Step::Covering { .. } | Step::Log { .. } => Ok(()),
        }
    }

    fn check_press(&self, press: &Press) -> Result<(), Outside> {
        self.check_place(press.at)?;
        check_duration(press.dwell_s)?;
        if let Some([dx_mm, dy_mm]) = press.approach_from_mm {
            self.check_place(Position { x_mm: press.at.x_mm + dx_mm, y_mm: press.at.y_mm + dy_mm })?;
        }
        check_speed(press.speed_mm_per_s, self.envelope.load_speed_max_mm_per_s, "load_speed_max_mm_per_s")?;
        for &depth_mm in &press.depths_mm {
            self.check_depth(depth_mm)?;
        }
        Ok(())
    }

    fn check_depth(&self, depth_mm: f64) -> Result<(), Outside> {
        let limit_mm = self.depth_max_mm();
        // Share times thickness is rounded: allow for that.
        if depth_mm <= limit_mm * (1.0 + 1e-12) {
            // A negative depth is a height and has the same bounds as every height.
            return check_axis("z", -depth_mm, [f64::NEG_INFINITY, self.envelope.z_max_mm]);
        }
        Err(Outside::Depth {
            depth_mm,
            limit_mm,
            share_percent: self.envelope.depth_share_max * 100.0,
            thickness_mm: self.covering.thickness_mm,
        })
    }

    fn check_place(&self, place: Position) -> Result<(), Outside> {
        let [x_mm, y_mm] = self.registration.to_robot([place.x_mm, place.y_mm]);
        check_axis("x", x_mm, self.envelope.x_mm)?;
        check_axis("y", y_mm, self.envelope.y_mm)
    }
}

fn check_duration(duration_s: f64) -> Result<(), Outside> {
    if (0.0..=DURATION_MAX_S).contains(&duration_s) { Ok(()) } else { Err(Outside::Duration { duration_s }) }
}

fn check_axis(axis: &'static str, value_mm: f64, [least_mm, greatest_mm]: [f64; 2]) -> Result<(), Outside> {
    // NaN is outside all bounds.
    if value_mm >= least_mm && value_mm <= greatest_mm {
        Ok(())
    } else {
        Err(Outside::Travel { axis, value_mm, least_mm, greatest_mm })
    }
}

fn check_speed(speed_mm_per_s: Option<f64>, limit_mm_per_s: f64, limit: &'static str) -> Result<(), Outside> {
    match speed_mm_per_s {
        Some(speed_mm_per_s) if !(speed_mm_per_s > 0.0 && speed_mm_per_s <= limit_mm_per_s) => {
            Err(Outside::Speed { speed_mm_per_s, limit_mm_per_s, limit })
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
#[path = "envelope_tests.rs"]
mod tests;
