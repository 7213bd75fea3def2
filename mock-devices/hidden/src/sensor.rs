//! A sensor with hidden physics, stepped along a path.

mod face;

use std::fmt;

use tactus_model::{Contact, Covering, Indenter, Path, Readout, Simulator};

use crate::climate::Climate;
use crate::physics::{Dose, Knobs, Now, PipelineHook, Tool, Touch};
use face::Face;

/// A virtual sensor with hidden physics. Each dose changes the base model's image at its stage of the pipeline.
///
/// ```text
/// path -> tool's place -> tool's face and spread -> indentations -> signals -> readings -> noise, converter
/// ```
///
/// Without doses it reads what [`tactus_model::ForwardModel`] does (to 1e-12 of a reading). Steps go forward in time; one
/// back in time counts as a step of 0 s. At the first step the sensor is at rest, without history.
pub struct HiddenSensor {
    base: Simulator,
    readout: Readout,
    climate: Climate,
    doses: Vec<Dose>,
    run: u64,
    hooks: Vec<PipelineHook>,
    stiffness: f64,
    parameters: Vec<Vec<(String, f64)>>,
    /// A requested step is divided into steps of at most this length.
    longest_step_s: f64,
    last_s: Option<f64>,
    now: Option<Now>,
    cached: Option<CachedImage>,
    counts: Vec<f64>,
}

/// The image of a cylinder, kept while only its depth changes.
#[derive(Debug)]
struct CachedImage {
    point_mm: [f64; 2],
    tool: Tool,
    image: Kept,
}

impl CachedImage {
    /// True if it was made for exactly this place and tool, to the bit.
    fn touches(&self, point_mm: [f64; 2], tool: &Tool) -> bool {
        let is_same = |one: [f64; 2], other: [f64; 2]| one.map(f64::to_bits) == other.map(f64::to_bits);
        is_same(self.point_mm, point_mm) && self.tool == *tool
    }
}

#[derive(Debug)]
enum Kept {
    /// The declared tool: the base model's image at this depth. Images at other depths are proportional.
    Declared { depth_mm: f64, indentation_mm: Vec<f64> },
    /// Any other tool.
    Changed(Face),
}

/// Step for physics with [`Definition::is_fine`](crate::Definition).
const FINE_STEP_S: f64 = 1.0 / 240.0;
/// A requested step is divided into at most this many, however long it is.
const STEPS_MAX: f64 = 64.0;
/// Speeds are backward differences over this time.
const SPEED_OVER_S: f64 = 0.002;

impl HiddenSensor {
    /// A sensor at rest. `run` selects the random numbers in time of the same physics.
    ///
    /// `base.effects` and `base.noise_rms_counts` are ignored: the physics is `doses`.
    pub fn new(base: &Simulator, doses: &[Dose], climate: Climate, run: u64) -> Self {
        let mut parameters = Vec::new();
        let mut make = |dose: &Dose| {
            let mut knobs = Knobs::new(dose, base, run);
            let hook = (dose.physics.make)(&mut knobs);
            parameters.push(knobs.into_drawn());
            hook
        };
        let hooks = doses.iter().map(&mut make).collect();
        let is_fine = doses.iter().any(|dose| dose.physics.is_fine);
        let elements = base.model.array().elements();
        Self {
            base: base.clone(),
            readout: Readout::of(base.model.array()),
            climate,
            doses: doses.to_vec(),
            run,
            hooks,
            parameters,
            longest_step_s: if is_fine { FINE_STEP_S } else { f64::INFINITY },
            last_s: None,
            now: None,
            cached: None,
            stiffness: 1.0,
            counts: vec![0.0; elements],
        }
    }

    /// Parameters that each dose drew, by name, in the order of the doses.
    pub fn parameters(&self) -> &[Vec<(String, f64)>] {
        &self.parameters
    }

    /// Rewires elements. Each entry is an element, the element whose indentation it gets, and the share of it.
    pub fn wire(&mut self, wiring: Vec<(usize, usize, f64)>) {
        self.hooks.push(PipelineHook::Covering(Box::new(move |_, indentation_mm| {
            let before_mm = indentation_mm.to_vec();
            for (element, answers_for, share) in &wiring {
                indentation_mm[*element] = share * before_mm[*answers_for];
            }
        })));
    }

    /// Puts another covering in place, without history.
    pub fn set_covering(&mut self, covering: Covering) {
        self.base.covering = covering;
        self.cached = None;
        for (hook, dose) in self.hooks.iter_mut().zip(&self.doses) {
            if let PipelineHook::Covering(_) | PipelineHook::Tool(_) = hook {
                *hook = (dose.physics.make)(&mut Knobs::new(dose, &self.base, self.run));
            }
        }
    }

    /// Moves the covering's surface to this height, robot frame.
    pub fn set_surface_mm(&mut self, surface_mm: f64) {
        self.base.surface_mm = surface_mm;
    }

    /// Multiplies every indentation by `stiffness`.
    pub fn set_stiffness(&mut self, stiffness: f64) {
        self.stiffness = stiffness;
    }

    /// Advances to `t_s`. Returns the counts of every element then, row-major, without noise.
    pub fn step(&mut self, t_s: f64, path: &impl Path) -> &[f64] {
        let last_s = self.last_s.unwrap_or(t_s);
        let steps = ((t_s - last_s) / self.longest_step_s).ceil().clamp(1.0, STEPS_MAX);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 64")]
        for step in 1..=steps as u32 {
            let at_s = last_s + (t_s - last_s) * f64::from(step) / steps;
            self.advance(at_s, (at_s - self.last_s.unwrap_or(at_s)).max(0.0), path);
            self.last_s = Some(at_s);
        }
        &self.counts
    }

    /// Counts of every element at the last step, row-major, without noise.
    pub fn counts(&self) -> &[f64] {
        &self.counts
    }

    /// Temperature at the last step, degrees Celsius; `None` before the first.
    pub fn temperature_c(&self) -> Option<f64> {
        self.now.map(|now| now.temperature_c)
    }

    /// The converter's output for clean counts plus noise: clipped, in whole steps.
    pub fn read(&self, counts: f64, noise_counts: f64) -> f64 {
        self.readout.read(self.convert(counts + noise_counts), 0.0)
    }

    /// The converter's output before quantisation: exact except for hidden physics of the converter.
    pub fn convert(&self, counts: f64) -> f64 {
        self.hooks.iter().fold(counts, |counts, hook| match hook {
            PipelineHook::Converter(convert) => convert(counts),
            PipelineHook::Path(_)
            | PipelineHook::Touch(_)
            | PipelineHook::Tool(_)
            | PipelineHook::Covering(_)
            | PipelineHook::Element(_)
            | PipelineHook::Readout(_) => counts,
        })
    }

    fn advance(&mut self, t_s: f64, dt_s: f64, path: &dyn Path) {
        let mut tip_mm = path.at(t_s);
        let before_mm = path.at(t_s - SPEED_OVER_S);
        let mut now = Now {
            t_s,
            dt_s,
            velocity_mm_per_s: [0, 1, 2].map(|axis| speed(before_mm[axis], tip_mm[axis])),
            temperature_c: self.climate.at(t_s),
            touch: Touch { point_mm: [0.0; 2], depth_mm: 0.0 },
        };
        for hook in &mut self.hooks {
            if let PipelineHook::Path(on_path) = hook {
                on_path(&now, path, &mut tip_mm);
            }
        }
        now.touch = Touch {
            point_mm: self.base.registration.to_sensor([tip_mm[0], tip_mm[1]]),
            depth_mm: self.base.surface_mm - tip_mm[2],
        };
        for hook in &mut self.hooks {
            if let PipelineHook::Touch(on_touch) = hook {
                let mut touch = now.touch;
                on_touch(&now, &mut touch);
                now.touch = touch;
            }
        }
        let mut tool = self.tool();
        for hook in &mut self.hooks {
            if let PipelineHook::Tool(on_tool) = hook {
                on_tool(&now, &mut tool);
            }
        }
        self.press(now.touch, tool);
        for hook in &mut self.hooks {
            if let PipelineHook::Covering(on_covering) = hook {
                on_covering(&now, &mut self.counts);
            }
        }
        self.counts.iter_mut().for_each(|value| *value *= self.stiffness);
        self.base.model.respond(&mut self.counts);
        self.amplify(&now);
        for hook in &mut self.hooks {
            if let PipelineHook::Readout(on_readout) = hook {
                on_readout(&now, &mut self.counts);
            }
        }
        self.now = Some(now);
    }

    /// Applies physics of elements, on the signal above the baseline.
    fn amplify(&mut self, now: &Now) {
        let baselines = &self.base.model.response().baseline_counts;
        let mut signal: Option<Vec<f64>> = None;
        for hook in &mut self.hooks {
            if let PipelineHook::Element(on_element) = hook {
                let signal = signal
                    .get_or_insert_with(|| self.counts.iter().zip(baselines).map(|(c, b)| c - b).collect());
                on_element(now, signal);
            }
        }
        if let Some(signal) = signal {
            for ((count, signal), baseline) in self.counts.iter_mut().zip(signal).zip(baselines) {
                *count = baseline + signal;
            }
        }
    }

    /// The tool as it is declared.
    fn tool(&self) -> Tool {
        let sigma_mm = self.base.model.psf().sigma_mm(self.base.covering);
        Tool { diameter_mm: diameter_mm(&self.base.indenter), lean: [0.0; 2], sigma_mm: [sigma_mm; 2] }
    }

    /// Writes the equivalent indentations of the tool at this place into `counts`, mm.
    fn press(&mut self, touch: Touch, tool: Tool) {
        let Touch { point_mm, depth_mm } = touch;
        if depth_mm <= 0.0 {
            self.counts.fill(0.0);
            return;
        }
        let Indenter::Cylinder { .. } = self.base.indenter else {
            // Hidden physics of the tool's face supports cylinders only.
            return self.exact(point_mm, depth_mm);
        };
        // A cylinder cannot go deeper than the covering is thick.
        let depth_mm = depth_mm.min(self.base.covering.thickness_mm);
        let kept = self.cached.take().filter(|kept| kept.touches(point_mm, &tool));
        let cached =
            kept.unwrap_or_else(|| CachedImage { point_mm, tool, image: self.image_of(point_mm, &tool) });
        match &cached.image {
            Kept::Declared { depth_mm: of_depth_mm, indentation_mm } => {
                for (value, image_mm) in self.counts.iter_mut().zip(indentation_mm) {
                    *value = image_mm * (depth_mm / of_depth_mm);
                }
            }
            Kept::Changed(face) => face.indentation(depth_mm, &mut self.counts),
        }
        self.cached = Some(cached);
    }

    fn image_of(&mut self, point_mm: [f64; 2], tool: &Tool) -> Kept {
        if *tool != self.tool() {
            return Kept::Changed(Face::new(&self.base.model, point_mm, tool));
        }
        let depth_mm = self.base.covering.thickness_mm / 2.0;
        self.exact(point_mm, depth_mm);
        Kept::Declared { depth_mm, indentation_mm: self.counts.clone() }
    }

    fn exact(&mut self, position_mm: [f64; 2], depth_mm: f64) {
        let rotation_deg = -self.base.registration.rotation_deg;
        let contact = Contact { indenter: self.base.indenter.clone(), position_mm, rotation_deg, depth_mm };
        self.base.model.indentation(&contact, self.base.covering, &mut self.counts);
    }
}

impl fmt::Debug for HiddenSensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("HiddenSensor")
            .field("parameters", &self.parameters)
            .field("now", &self.now)
            .finish_non_exhaustive()
    }
}

/// Speeds below a nanometre a second are rounding.
fn speed(before_mm: f64, after_mm: f64) -> f64 {
    let mm_per_s = (after_mm - before_mm) / SPEED_OVER_S;
    if mm_per_s.abs() < 1e-6 { 0.0 } else { mm_per_s }
}

/// Diameter of a round tool; 0 for others.
pub(crate) fn diameter_mm(indenter: &Indenter) -> f64 {
    match indenter {
        Indenter::Cylinder { diameter_mm }
        | Indenter::Sphere { diameter_mm }
        | Indenter::Cone { diameter_mm, .. } => *diameter_mm,
        Indenter::Box { .. } | Indenter::Mesh(_) => 0.0,
    }
}

#[cfg(test)]
#[path = "sensor_tests.rs"]
mod tests;
