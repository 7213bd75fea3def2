//! How far a dry run is, whose script nobody has run before.
//!
//! An outline is the script's run without a rig: each step is answered at once, with readings of zero. It takes milliseconds and says about how
//! long the steps are that will come. A script that looks at its readings may do others: the time left is wrong then, and nothing
//! else depends on it.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle};

use tactus_engine::RunOrder;
use tactus_plan::{
    Arguments, Call, Evaluate, Host, MeanReading, Outcome, Parameter, Refusal, Reply, RigView, Script,
    ScriptError, ScriptLimits, Step,
};
use tactus_schema::Rig;
use tactus_schema::rig::Motion;

/// Compares the steps that were done with those of the outline.
#[derive(Debug)]
pub(crate) struct Outline {
    rig: RigView,
    motion: Motion,
    order: RunOrder,
    done: Length,
    whole: Arc<OnceLock<f64>>,
    is_over: Arc<AtomicBool>,
}

/// Length of steps, ms of the rig's time. Steps that an earlier run has done have none.
#[derive(Debug, Clone, Default)]
struct Length(Arc<AtomicU64>);

impl Outline {
    /// Of an order that will be run with [`Outline::evaluator`]; `None` of a rig that is not in service.
    pub(crate) fn of(rig: &Rig, order: &RunOrder) -> Option<Self> {
        let motion = rig.service.as_ref()?.motion;
        Some(Self {
            rig: RigView::of(rig),
            motion,
            order: order.clone(),
            done: Length::default(),
            whole: Arc::default(),
            is_over: Arc::default(),
        })
    }

    /// The order's evaluator, with the steps measured as they are done.
    pub(crate) fn evaluator(&self) -> Arc<dyn Evaluate> {
        let (evaluator, motion) = (Arc::clone(&self.order.evaluator), self.motion);
        Arc::new(Measured { evaluator, motion, taken_over: self.taken_over(), done: self.done.clone() })
    }

    /// Begins to find out how long all steps are, on a thread of its own.
    pub(crate) fn begin(&self) -> io::Result<JoinHandle<()>> {
        let Self { rig, motion, order, whole, is_over, .. } = self;
        let (rig, order, whole) = (rig.clone(), order.clone(), Arc::clone(whole));
        let mut host = Unmoved { elements: rig.elements.len(), is_over: Arc::clone(is_over) };
        let (motion, taken_over) = (*motion, self.taken_over());
        thread::Builder::new().name("outline".into()).spawn(move || {
            let RunOrder { script, arguments, seed, limits, evaluator, .. } = order;
            let length = Length::default();
            let measured = Measured { evaluator, motion, taken_over, done: length.clone() };
            if measured.execute(&script, &arguments, &rig, seed, &limits, &mut host).is_ok() {
                // There is one outline only.
                let _first = whole.set(length.ms());
            }
        })
    }

    /// Share of the steps that is done, 0 to 1; `None` while it is not known, or if no step takes time.
    pub(crate) fn share(&self) -> Option<f64> {
        let whole = self.whole.get().copied().filter(|whole| *whole > 0.0)?;
        Some((self.done.ms() / whole).min(1.0))
    }

    fn taken_over(&self) -> usize {
        self.order.earlier.as_ref().map_or(0, |earlier| earlier.steps.len())
    }
}

impl Drop for Outline {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
    }
}

impl Length {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "lengths of time")]
    fn add(&self, seconds: f64) {
        self.0.fetch_add((seconds * 1e3) as u64, Ordering::Relaxed);
    }

    fn ms(&self) -> f64 {
        self.0.load(Ordering::Relaxed) as f64
    }
}

/// Rig time that a step takes, without the way to its place.
fn length_s(step: &Step, motion: &Motion) -> f64 {
    let up_and_down_s = 2.0 * motion.safe_height_mm / motion.travel_speed_mm_per_s;
    match step {
        Step::Press(press) => {
            let held = press.depths_mm.len() as f64 * (motion.settle_s + press.dwell_s);
            let speed = press.speed_mm_per_s.unwrap_or(motion.load_speed_mm_per_s);
            let down_and_up_mm = 2.0 * press.depths_mm.iter().copied().fold(0.0, f64::max);
            up_and_down_s + held + down_and_up_mm / speed
        }
        Step::Move { .. } => up_and_down_s,
        Step::Dwell { duration_s } => motion.settle_s + duration_s,
        Step::Read { duration_s } | Step::Tare { duration_s } | Step::Wait { duration_s } => *duration_s,
        Step::Log { .. } | Step::Covering { .. } => 0.0,
    }
}

/// Evaluates as another evaluator, and adds up the steps.
#[derive(Debug)]
struct Measured {
    evaluator: Arc<dyn Evaluate>,
    motion: Motion,
    /// Number of the first steps that an earlier run has done.
    taken_over: usize,
    done: Length,
}

impl Evaluate for Measured {
    fn execute(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        seed: u64,
        limits: &ScriptLimits,
        host: &mut dyn Host,
    ) -> Result<Outcome, ScriptError> {
        let mut host = MeasuredHost { host, measured: self, steps: 0 };
        self.evaluator.execute(script, arguments, rig, seed, limits, &mut host)
    }

    fn resolve(
        &self,
        script: &Script,
        arguments: &Arguments,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Arguments, ScriptError> {
        self.evaluator.resolve(script, arguments, rig, limits, stopped)
    }

    fn parameters(
        &self,
        script: &Script,
        rig: &RigView,
        limits: &ScriptLimits,
        stopped: &dyn Fn() -> bool,
    ) -> Result<Vec<Parameter>, ScriptError> {
        self.evaluator.parameters(script, rig, limits, stopped)
    }
}

struct MeasuredHost<'a> {
    host: &'a mut dyn Host,
    measured: &'a Measured,
    steps: usize,
}

impl Host for MeasuredHost<'_> {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        let reply = self.host.perform(call)?;
        self.steps += 1;
        if self.steps > self.measured.taken_over {
            self.measured.done.add(length_s(&call.step, &self.measured.motion));
        }
        Ok(reply)
    }

    fn cancelled(&self) -> bool {
        self.host.cancelled()
    }
}

/// A rig on which nothing is ever felt.
struct Unmoved {
    elements: usize,
    is_over: Arc<AtomicBool>,
}

impl Host for Unmoved {
    fn perform(&mut self, call: &Call) -> Result<Reply, Refusal> {
        let zeros = vec![0.0; self.elements];
        let reading =
            MeanReading { mean_counts: zeros.clone(), signal: zeros.clone(), rms: zeros, frames: 1 };
        Ok(match &call.step {
            Step::Press(press) => Reply::Pressed(vec![reading; press.depths_mm.len()]),
            Step::Dwell { .. } | Step::Read { .. } | Step::Tare { .. } => Reply::Reading(reading),
            Step::Move { to, height_mm, .. } => {
                Reply::Position { x_mm: to.x_mm, y_mm: to.y_mm, height_mm: height_mm.unwrap_or_default() }
            }
            Step::Wait { .. } | Step::Log { .. } | Step::Covering { .. } => Reply::Done,
        })
    }

    fn cancelled(&self) -> bool {
        self.is_over.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
#[path = "outline_tests.rs"]
mod tests;
