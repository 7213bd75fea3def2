//! Whether the array responds to the tip: it must not be frozen, and a deep tip must be felt.

use tactus_model::{Covering, Psf, Registration};
use tactus_schema::rig::Service;
use tactus_schema::{Frame, Rig};

use crate::Violation;
use crate::force::Elements;
use crate::limits::{Limits, STEP_DOWN_MAX_MM};

/// Frames with the old counts, received after the tip has moved, after which the array counts as frozen.
const FROZEN_FRAMES: u32 = 3;

/// Way of the tip in the covering during identical frames: a step and a half, because a frame may show one step that the
/// stage has not yet reported.
const FROZEN_WAY_MM: f64 = 1.5 * STEP_DOWN_MAX_MM;

/// Share of the depth limit from which a response is expected.
const FELT_DEPTH_SHARE: f64 = 0.5;

/// Share of the reading of a press at the element's centre that the best element must show. Between elements, under the
/// widest point spread, the nearest one shows more than half.
const FELT_RISE_SHARE: f64 = 0.05;

/// Frames without a response, with the tip standing deep, that are a stop. The first two may be older than the stage's report.
const UNFELT_FRAMES: u32 = 4;

/// Watches the response to the tip.
#[derive(Debug)]
pub(crate) struct Contact {
    /// False where the rig file says so, and where the elements are components of a field: they are nowhere then.
    expects_response: bool,
    registration: Registration,
    /// Outline of the array, sensor frame: least and greatest x, and y.
    extent_mm: [[f64; 2]; 2],
    /// Of the array's median element, under the reference covering.
    sensitivity_counts_per_mm: f64,
    /// Spread under a covering, and under the reference covering.
    psf: Psf,
    reference_sigma_mm: f64,
    /// Least expected rise, for each mm of depth, under the covering in place.
    felt_counts_per_mm: f64,
    /// The frame that has been repeated, with the height of the tip at its first arrival.
    repeated: Repeated,
    /// Frames without a response since the tip stands deep.
    unfelt_frames: u32,
}

#[derive(Debug, Default)]
struct Repeated {
    counts: Vec<f32>,
    z_mm: f64,
    /// Since the tip has moved.
    frames: u32,
}

impl Contact {
    pub(crate) fn new(rig: &Rig, service: &Service) -> Self {
        let mut sensitivities: Vec<_> =
            rig.sensitivity_counts_per_mm.iter().map(|counts| counts.abs()).collect();
        sensitivities.sort_by(f64::total_cmp);
        let mut contact = Self {
            expects_response: service.envelope.expects_response && !service.sensor.protocol.is_signed(),
            registration: rig.registration,
            extent_mm: rig.array.extent_mm(),
            sensitivity_counts_per_mm: sensitivities.get(sensitivities.len() / 2).copied().unwrap_or(0.0),
            psf: rig.psf,
            reference_sigma_mm: rig.psf.sigma_mm(rig.sensitivity_reference.covering),
            felt_counts_per_mm: 0.0,
            repeated: Repeated::default(),
            unfelt_frames: 0,
        };
        contact.set_covering(rig.covering);
        contact
    }

    /// Sets the covering in place. A thicker one spreads a press over a greater area: the peak of a spread of unit volume
    /// falls with the square of its width. Under a thinner one no more is expected than under the reference covering.
    pub(crate) fn set_covering(&mut self, covering: Covering) {
        let spread = (self.reference_sigma_mm / self.psf.sigma_mm(covering)).powi(2).min(1.0);
        self.felt_counts_per_mm = FELT_RISE_SHARE * self.sensitivity_counts_per_mm * spread;
    }

    /// The tip is about to move: a frame may show that before the stage reports it.
    pub(crate) fn expect_motion(&mut self) {
        self.unfelt_frames = 0;
    }

    /// Takes a frame that arrived with the tip at a known position, robot frame.
    pub(crate) fn take(
        &mut self,
        frame: &Frame,
        [x_mm, y_mm, z_mm]: [f64; 3],
        is_standing: bool,
        elements: &Elements,
        limits: &Limits,
    ) -> Option<Violation> {
        let is_over_array = self.is_over_array([x_mm, y_mm]);
        let repeated = &mut self.repeated;
        if repeated.counts[..] != frame.counts[..] || z_mm >= 0.0 || !is_over_array {
            repeated.counts.clear();
            repeated.counts.extend_from_slice(&frame.counts);
            (repeated.z_mm, repeated.frames) = (z_mm, 0);
        } else {
            let way_mm = (z_mm - repeated.z_mm).abs();
            // A frame that was taken before the tip moved is no evidence.
            repeated.frames += u32::from(way_mm > FROZEN_WAY_MM);
            // An array that has felt nothing yet is another matter.
            let felt_counts = self.felt_counts_per_mm * FROZEN_WAY_MM;
            let is_felt =
                elements.greatest_rise_counts().is_some_and(|rise_counts| rise_counts >= felt_counts);
            if repeated.frames >= FROZEN_FRAMES && is_felt {
                return Some(Violation::Frozen { frames: repeated.frames, way_mm });
            }
        }
        let depth_mm = -z_mm;
        let rise_counts = elements.greatest_rise_counts()?;
        let least_counts = self.felt_counts_per_mm * depth_mm;
        let is_deep = depth_mm >= FELT_DEPTH_SHARE * limits.depth_max_mm;
        let is_unfelt = is_over_array && is_standing && is_deep && rise_counts < least_counts;
        self.unfelt_frames = if is_unfelt { self.unfelt_frames + 1 } else { 0 };
        (self.unfelt_frames >= UNFELT_FRAMES).then_some(Violation::NoResponse {
            rise_counts,
            least_counts,
            depth_mm,
        })
    }

    fn is_over_array(&self, at_mm: [f64; 2]) -> bool {
        let at_mm = self.registration.to_sensor(at_mm);
        self.expects_response
            && at_mm
                .iter()
                .zip(self.extent_mm)
                .all(|(at_mm, [least_mm, greatest_mm])| (least_mm..=greatest_mm).contains(at_mm))
    }
}
