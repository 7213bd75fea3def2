//! `backlash`: the tip lags behind the position that the stage reports, depending on the direction of approach.
//!
//! ```text
//! q(t) = max(x(t) - play / 2, min(x(t) + play / 2, q before))          on each of the robot's axes
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `play_x_mm` | mm | 0 | 0 to 1 | width of the play on the robot's x axis |
//! | `play_y_mm` | mm | 0 | 0 to 1 | width of the play on the robot's y axis |
//! | `play_z_mm` | mm | 0 | 0 to 0.5 | width of the play on the robot's z axis |
//!
//! `x` is the position that the stage reports, `q` the true one. The tip follows half the play behind a moving stage, and
//! rests for the whole play after the stage turns. The mean of two opposite approaches is the position of the registration,
//! or of the surface. The tip begins in the middle of its play.
//!
//! Cost: none.
//!
//! # Source
//! The play operator: M. A. Krasnosel'skii and A. V. Pokrovskii, *Systems with Hysteresis* (1989).

use super::{Definition, Make, Now, OnMotion, Parameter, TipState};
use crate::trace::Covariate;

pub(super) static DEFINITION: Definition = Definition {
    name: "backlash",
    summary: "the tip's position depends on the direction of approach",
    parameters: &[
        Parameter::real("play_x_mm", 0.0, [0.0, 1.0]),
        Parameter::real("play_y_mm", 0.0, [0.0, 1.0]),
        Parameter::real("play_z_mm", 0.0, [0.0, 0.5]),
    ],
    near_twins: &["hysteresis", "misregistration", "surface-offset", "time-lag"],
    acts_by: &[Covariate::Direction, Covariate::ApproachX, Covariate::ApproachY, Covariate::Ahead],
    shown_by: &["approach", "ladder"],
    curve: None,
    make: Make::Motion(|values| Box::new(Backlash { axes: [0, 1, 2].map(|axis| Axis::new(values[axis])) })),
};

#[derive(Debug)]
struct Backlash {
    axes: [Axis; 3],
}

/// One axis: a nut with play on a screw.
#[derive(Debug)]
struct Axis {
    half_mm: f64,
    /// Position of the tip.
    at_mm: Option<f64>,
}

impl OnMotion for Backlash {
    fn place(&mut self, _: Now<'_>, tip: &mut TipState) {
        for (axis, tip_mm) in self.axes.iter_mut().zip(&mut tip.tip_mm) {
            *tip_mm = axis.follow(*tip_mm);
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        for axis in &mut self.axes {
            axis.at_mm = None;
        }
    }
}

impl Axis {
    fn new(play_mm: f64) -> Self {
        Self { half_mm: play_mm / 2.0, at_mm: None }
    }

    fn follow(&mut self, stage_mm: f64) -> f64 {
        let (least, most) = (stage_mm - self.half_mm, stage_mm + self.half_mm);
        let at_mm = match self.at_mm.unwrap_or(stage_mm) {
            at_mm if at_mm < least => least,
            at_mm if at_mm > most => most,
            at_mm => at_mm,
        };
        self.at_mm = Some(at_mm);
        at_mm
    }
}

#[cfg(test)]
#[path = "backlash_tests.rs"]
mod tests;
