//! Whether the array responds to the tip: it must not be frozen, and a deep tip must be felt.

use tactus_model::Registration;
use tactus_schema::{Frame, Rig};

use crate::Violation;
use crate::force::Elements;
use crate::limits::Limits;

/// Identical frames after which the array counts as frozen, if the tip moved meanwhile.
const FROZEN_FRAMES: u32 = 3;

/// Way of the tip in the covering during identical frames.
const FROZEN_WAY_MM: f64 = 0.08;

/// Share of the depth limit from which a response is expected.
const FELT_DEPTH_SHARE: f64 = 0.5;

/// Share of the reading of a press at the element's centre that the best element must show. Between elements, under the
/// widest point spread, the nearest one shows more than half.
const FELT_RISE_SHARE: f64 = 0.05;

/// Watches the response to the tip.
#[derive(Debug)]
pub(crate) struct Contact {
    registration: Registration,
    /// Outline of the array, sensor frame: least and greatest x, and y.
    extent_mm: [[f64; 2]; 2],
    /// Of the array's median element.
    sensitivity_counts_per_mm: f64,
    /// The frame that has been repeated, with the height of the tip at its first arrival.
    repeated: Option<Repeated>,
}

#[derive(Debug)]
struct Repeated {
    counts: Vec<f32>,
    z_mm: f64,
    frames: u32,
}

impl Contact {
    pub(crate) fn new(rig: &Rig) -> Self {
        let mut sensitivities: Vec<_> = rig.sensitivity_counts_per_mm.iter().map(|counts| counts.abs()).collect();
        sensitivities.sort_by(f64::total_cmp);
        Self {
            registration: rig.registration,
            extent_mm: rig.array.extent_mm(),
            sensitivity_counts_per_mm: sensitivities.get(sensitivities.len() / 2).copied().unwrap_or(0.0),
            repeated: None,
        }
    }

    /// Takes a frame that arrived with the tip at a known position, robot frame.
    pub(crate) fn take(
        &mut self,
        frame: &Frame,
        [x_mm, y_mm, z_mm]: [f64; 3],
        elements: &Elements,
        limits: &Limits,
    ) -> Option<Violation> {
        let is_new = self.repeated.as_ref().is_none_or(|repeated| repeated.counts[..] != frame.counts[..]);
        let is_over_array = self.is_over_array([x_mm, y_mm]);
        if is_new || z_mm >= 0.0 || !is_over_array {
            self.repeated = Some(Repeated { counts: frame.counts.to_vec(), z_mm, frames: 1 });
        } else if let Some(repeated) = &mut self.repeated {
            repeated.frames += 1;
            let way_mm = (z_mm - repeated.z_mm).abs();
            if repeated.frames > FROZEN_FRAMES && way_mm > FROZEN_WAY_MM {
                return Some(Violation::Frozen { frames: repeated.frames, way_mm });
            }
        }
        let depth_mm = -z_mm;
        if !is_over_array || depth_mm < FELT_DEPTH_SHARE * limits.depth_max_mm {
            return None;
        }
        let rise_counts = elements.greatest_rise_counts()?;
        let least_counts = FELT_RISE_SHARE * self.sensitivity_counts_per_mm * depth_mm;
        (rise_counts < least_counts).then_some(Violation::NoResponse { rise_counts, least_counts, depth_mm })
    }

    fn is_over_array(&self, at_mm: [f64; 2]) -> bool {
        let at_mm = self.registration.to_sensor(at_mm);
        at_mm.iter().zip(self.extent_mm).all(|(at_mm, [least_mm, greatest_mm])| (least_mm..=greatest_mm).contains(at_mm))
    }
}
