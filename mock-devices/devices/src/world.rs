//! The one true state that both virtual devices share: where the tip is, what it presses, what the elements read.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tactus_model::{Covering, Moment, Trail};
use tactus_schema::rig::{ElementFault, SimulatedStage, StageProtocol};
use tokio::time::Instant;

use crate::motion::{Motion, Point};
use crate::sensor_model::SensorModel;
use crate::truth::{RandomStream, Truth};

/// The world, shared by the devices and their controls. The lock is held for one read or one change at a time.
#[derive(Debug, Clone)]
pub(crate) struct SharedWorld(Arc<Mutex<World>>);

/// The truth, and the state that changes.
#[derive(Debug)]
pub(crate) struct World {
    truth: Arc<Truth>,
    /// Motion of the tip, if one controller moves all axes.
    pub(crate) motion: Motion,
    /// Motions of x, y and z, if each axis moves by itself; the other two coordinates of each are 0.
    by_axis: Option<[Motion; 3]>,
    covering: Covering,
    surface_mm: f64,
    deepest_mm: f64,
    /// False if no element has noise: none is drawn then.
    is_noisy: bool,
    noise: ChaCha8Rng,
    /// Readings taken so far.
    samplings: u64,
    sensor_model: Box<dyn SensorModel>,
    /// Zero of the sensor model's time (its first sampling), and the tip's path since.
    trail: Option<(Instant, Trail)>,
}

impl SharedWorld {
    pub(crate) fn new(world: World) -> Self {
        Self(Arc::new(Mutex::new(world)))
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, World> {
        // After a panic elsewhere the world is still consistent: every change is one assignment.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl World {
    /// A rig that was just switched on: the tip is near the top of its travel, and the controller believes that it is
    /// at 0.
    ///
    /// # Panics
    /// If the truth was not made by its own constructors, which check that effects name elements of the array.
    #[expect(clippy::expect_used, reason = "a truth's effects name elements of its array")]
    pub(crate) fn new(truth: Arc<Truth>, covering: Covering) -> Self {
        let [x_mm, y_mm, z_mm] = truth.stage.travel_mm;
        let tip_mm = [middle(x_mm), middle(y_mm), z_mm[1] - 0.1 * (z_mm[1] - z_mm[0])];
        let sensor_model = truth.sensor_model(covering).expect("a checked truth makes a sensor");
        let acceleration_mm_per_s2 = truth.stage.acceleration_mm_per_s2;
        let by_axis = match &truth.stage_protocol {
            StageProtocol::Grbl(_) => None,
            // A missing axis stays at 0.
            StageProtocol::Zaber(_) => Some(std::array::from_fn(|axis| {
                let at_mm = if truth.stage_protocol.has_axis(axis) { tip_mm[axis] } else { 0.0 };
                Motion::at_rest([0.0; 3], on_axis(axis, at_mm), acceleration_mm_per_s2)
            })),
        };
        Self {
            motion: Motion::at_rest([0.0; 3], tip_mm, acceleration_mm_per_s2),
            by_axis,
            covering,
            surface_mm: truth.surface_mm,
            deepest_mm: truth.surface_mm - tip_mm[2],
            is_noisy: truth.noise_rms_counts != 0.0
                || truth.faults.values().any(|fault| matches!(fault, ElementFault::Noisy { .. })),
            noise: RandomStream::Noise.rng(truth.seed),
            samplings: 0,
            sensor_model,
            trail: None,
            truth,
        }
    }

    /// Has the tip stand at a place that is known, whatever moves the axes.
    pub(crate) fn stand_at(&mut self, at_mm: Point) {
        self.by_axis = None;
        self.motion = Motion::at_rest(at_mm, at_mm, self.truth.stage.acceleration_mm_per_s2);
        self.deepest_mm = self.surface_mm - at_mm[2];
    }

    /// The truth that the rig hides.
    pub(crate) fn truth(&self) -> &Arc<Truth> {
        &self.truth
    }

    /// Writes one reading of all elements at `at` into `counts`, with noise, saturation and quantisation.
    pub(crate) fn sample(&mut self, at: Instant, counts: &mut Vec<u16>) {
        self.look(at);
        self.samplings += 1;
        let Self { truth, is_noisy, noise, sensor_model, .. } = self;
        counts.clear();
        counts.extend(sensor_model.counts().iter().enumerate().map(|(element, clean)| {
            // Drawn for a stuck element too, so that its fault does not change the noise of others.
            let deviate: f64 = if *is_noisy { StandardNormal.sample(noise) } else { 0.0 };
            let noise_rms_counts = match truth.faults.get(&element) {
                Some(ElementFault::Stuck { counts }) => return *counts,
                Some(ElementFault::Noisy { noise_rms_counts }) => *noise_rms_counts,
                Some(ElementFault::Miswired { .. } | ElementFault::Dead) | None => truth.noise_rms_counts,
            };
            let read = sensor_model.read(*clean, noise_rms_counts * deviate);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "whole and not negative"
            )]
            let count = read.min(f64::from(u16::MAX)) as u16;
            count
        }));
    }

    /// Number of readings of all elements that were taken so far.
    pub(crate) fn samplings(&self) -> u64 {
        self.samplings
    }

    /// The image without noise, in counts, row-major.
    pub(crate) fn image(&mut self, at: Instant) -> Vec<f64> {
        self.look(at);
        let read = |(element, clean): (usize, &f64)| match self.truth.faults.get(&element) {
            Some(ElementFault::Stuck { counts }) => f64::from(*counts),
            Some(ElementFault::Miswired { .. } | ElementFault::Dead | ElementFault::Noisy { .. }) | None => {
                *clean
            }
        };
        self.sensor_model.counts().iter().enumerate().map(read).collect()
    }

    /// True position of the tip, rounded to the stage's steps.
    pub(crate) fn tip_mm(&self, at: Instant) -> Point {
        self.in_steps(self.of_motion(|motion| motion.true_mm(at)))
    }

    /// Position of the tip that the controller believes, rounded to the stage's steps.
    pub(crate) fn believed_mm(&self, at: Instant) -> Point {
        self.in_steps(self.of_motion(|motion| motion.believed_mm(at)))
    }

    /// Depth of the tip below the covering's true surface; negative above it.
    pub(crate) fn depth_mm(&self, at: Instant) -> f64 {
        self.surface_mm - self.tip_mm(at)[2]
    }

    /// Greatest depth in the present covering until `now`.
    pub(crate) fn deepest_mm(&mut self, now: Instant) -> f64 {
        self.settle(now);
        self.deepest_mm
    }

    /// Updates the greatest depth up to `now` and removes finished moves. Call it before every change of the motion.
    pub(crate) fn settle(&mut self, now: Instant) {
        // On a straight line the greatest depth is at an end: that of a finished move, or the present position.
        let vertical = self.by_axis.as_ref().map_or(&self.motion, |[_, _, z]| z);
        let ends = vertical.true_ends_mm().filter(|(end, _)| *end <= now).map(|(_, tip_mm)| tip_mm);
        let lowest_mm = ends.chain([vertical.true_mm(now)]).map(|[_, _, z]| z).fold(f64::INFINITY, f64::min);
        let vertical_step_mm = self.truth.stage.vertical_step_mm;
        self.deepest_mm = self.deepest_mm.max(self.surface_mm - round_to(lowest_mm, vertical_step_mm));
        self.motions().for_each(|motion| motion.settle(now));
    }

    /// True while anything moves.
    pub(crate) fn is_moving(&mut self) -> bool {
        self.motions().any(|motion| motion.is_moving())
    }

    /// The motion of one axis if each moves by itself, else that of all.
    pub(crate) fn motion_of(&mut self, axis: usize) -> &mut Motion {
        match &mut self.by_axis {
            Some(motions) => &mut motions[axis],
            None => &mut self.motion,
        }
    }

    /// All motions.
    fn motions(&mut self) -> impl Iterator<Item = &mut Motion> {
        let (all, each) = match &mut self.by_axis {
            Some(motions) => (None, Some(motions)),
            None => (Some(&mut self.motion), None),
        };
        all.into_iter().chain(each.into_iter().flatten())
    }

    /// Combines a position from the coordinate of each motion.
    fn of_motion(&self, place: impl Fn(&Motion) -> Point) -> Point {
        match &self.by_axis {
            Some(motions) => std::array::from_fn(|axis| place(&motions[axis])[axis]),
            None => place(&self.motion),
        }
    }

    /// Thickness of the covering in place.
    pub(crate) fn covering_mm(&self) -> f64 {
        self.covering.thickness_mm
    }

    /// Puts another covering in place; its surface stays at the same height. Nothing was pressed into it yet.
    pub(crate) fn set_covering_mm(&mut self, thickness_mm: f64, now: Instant) {
        self.settle(now);
        self.covering = Covering { thickness_mm: thickness_mm.max(0.0) };
        self.sensor_model.set_covering(self.covering);
        self.deepest_mm = self.depth_mm(now);
    }

    /// Moves the true surface; the service still believes 0.
    pub(crate) fn set_surface_mm(&mut self, surface_mm: f64, now: Instant) {
        self.settle(now);
        self.surface_mm = surface_mm;
        self.sensor_model.set_surface_mm(surface_mm);
        self.settle(now);
    }

    /// Multiplies the response of the covering by `stiffness`.
    pub(crate) fn set_stiffness(&mut self, stiffness: f64) {
        self.sensor_model.set_stiffness(stiffness);
    }

    fn look(&mut self, at: Instant) {
        let tip_mm = self.tip_mm(at);
        let (started, trail) = self.trail.get_or_insert_with(|| (at, Trail::new(0.0, tip_mm)));
        let t_s = at.saturating_duration_since(*started).as_secs_f64();
        trail.push(t_s, tip_mm);
        self.sensor_model.step(Moment::at(t_s), trail);
    }

    fn in_steps(&self, [x, y, z]: Point) -> Point {
        let SimulatedStage { lateral_step_mm, vertical_step_mm, .. } = self.truth.stage;
        [round_to(x, lateral_step_mm), round_to(y, lateral_step_mm), round_to(z, vertical_step_mm)]
    }
}

/// A position on one axis; the other two coordinates are 0.
pub(crate) fn on_axis(axis: usize, mm: f64) -> Point {
    let mut place = [0.0; 3];
    place[axis] = mm;
    place
}

fn round_to(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}

fn middle([least, greatest]: [f64; 2]) -> f64 {
    f64::midpoint(least, greatest)
}

#[cfg(test)]
#[path = "world_tests.rs"]
mod tests;
