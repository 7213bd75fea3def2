//! The catalogue of hidden physics, its parameters, and the hooks into the pipeline.

mod contact;
mod converter;
mod drift;
mod element;
mod friction;
mod hardening;
mod hysteresis;
mod memory;
mod motion;
mod outside;
mod rate;
mod readout;
mod registration;
mod relaxation;
mod skin;
mod spread;
mod surface;
mod surroundings;
mod timing;
mod wiring;

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tactus_model::{Path, Simulator};

/// One physics that a simulated sensor may have.
#[derive(Debug, Clone, Copy)]
pub struct Definition {
    /// Unique.
    pub id: &'static str,
    /// The library's effect that it is an instance of; `None` if there is none.
    pub effect: Option<&'static str>,
    /// True if the library's effect does exactly this at some values of its parameters. Sets with it say nothing about other forms.
    pub is_library_point: bool,
    /// What it does: equation and source.
    pub about: &'static str,
    /// True if it needs time steps finer than a frame.
    pub(crate) is_fine: bool,
    pub(crate) make: fn(&mut Knobs<'_>) -> PipelineHook,
}

/// A physics at a strength.
#[derive(Debug, Clone, Copy)]
pub struct Dose {
    /// Its entry in the catalogue.
    pub physics: &'static Definition,
    /// 0 is none, 1 is that of a bad rig; at most [`STRENGTH_MAX`].
    pub strength: f64,
    /// Seed of its shape: time constants, directions, elements.
    pub seed: u64,
}

/// The greatest strength: no rig is worse.
pub const STRENGTH_MAX: f64 = 8.0;

/// Every physics, those of the library's effects first.
pub static CATALOGUE: &[&Definition] = &[
    &motion::SHIFTED_MOUNT,
    &motion::TURNED_MOUNT,
    &motion::STRETCHED_STAGE,
    &motion::SHEARED_STAGE,
    &registration::BENT_GUIDE,
    &registration::SCREW_ERROR,
    &registration::UNEQUAL_AXES,
    &motion::LATE_TOUCH,
    &motion::DEAD_BAND,
    &surface::TOE,
    &surface::SETTLING_SURFACE,
    &surface::THERMAL_GROWTH,
    &motion::SLOPING_SURFACE,
    &surface::BOWED_SURFACE,
    &surface::FOLDED_SURFACE,
    &surface::TWISTED_SURFACE,
    &motion::LATE_FRAMES,
    &timing::JITTER,
    &timing::CLOCKS_APART,
    &timing::BUNDLES,
    &motion::LOST_MOTION,
    &friction::DAHL,
    &friction::WORN_SCREW,
    &friction::STICTION,
    &contact::WORN_TOOL,
    &contact::ROUNDED_RIM,
    &contact::SPREADING_TIP,
    &contact::WEARING_TOOL,
    &contact::COCKED_TOOL,
    &contact::WOBBLING_TOOL,
    &contact::YIELDING_TOOL,
    &contact::BENDING_ARM,
    &hardening::EXPONENTIAL,
    &hardening::POWER,
    &hardening::QUADRATIC,
    &hardening::LIMIT,
    &hardening::TWO_LAYERS,
    &hardening::STEP,
    &hardening::OWN_KNEE,
    &spread::LAYERED_TAIL,
    &spread::EXPONENTIAL_TAIL,
    &spread::POWER_TAIL,
    &spread::PLATE_TAIL,
    &spread::STRETCHED,
    &spread::SLANTED,
    &spread::STRETCHED_BY_DEPTH,
    &spread::STRETCHED_HALF,
    &spread::WIDER_WITH_DEPTH,
    &spread::NARROWER_AT_FIRST,
    &spread::WIDER_BEYOND,
    &spread::WIDER_CUBED,
    &spread::SOFT_EDGE,
    &spread::SEAM,
    &spread::SOFT_CORNERS,
    &spread::GLUED_SIDE,
    &relaxation::PRONY,
    &relaxation::POWER_LAW,
    &relaxation::LOGARITHMIC,
    &relaxation::STRETCHED,
    &relaxation::BY_LOAD,
    &hysteresis::PRANDTL_ISHLINSKII,
    &hysteresis::PREISACH,
    &hysteresis::BOUC_WEN,
    &rate::POWER,
    &rate::LOGARITHMIC,
    &rate::EYRING,
    &rate::SATURATING,
    &memory::IMPRINT_POWER_LAW,
    &memory::IMPRINT_TWO_EXPONENTIALS,
    &memory::IMPRINT_DWELL,
    &memory::MULLINS_EXPONENTIAL,
    &memory::MULLINS_DISCONTINUOUS,
    &memory::SOFTENING_WORK,
    &element::LADDER,
    &element::NEIGHBOURS,
    &element::COLUMN_SUM,
    &element::GHOST,
    &element::STRAY_FIELD,
    &element::DEAD,
    &element::ANSWERS_FOR_NEIGHBOUR,
    &wiring::LOOSE_CONTACT,
    &wiring::FLICKERING_ADDRESS,
    &wiring::OPENS_WHEN_PRESSED,
    &element::RATIONAL,
    &element::EXPONENTIAL,
    &element::KNEE,
    &drift::COMMON_WALK,
    &drift::ORNSTEIN_UHLENBECK,
    &drift::WARM_UP,
    &drift::GAIN_WARM_UP,
    &drift::GAIN_WALK,
    &drift::GAIN_TEMPERATURE,
    &drift::GAIN_WARMTH,
    &drift::GAIN_CYCLE,
    &drift::GAIN_JUMPS,
    &readout::SECOND_ORDER,
    &readout::MOVING_AVERAGE,
    &readout::UNEVEN,
    &readout::ROWS,
    &readout::ELEMENTS,
    &timing::INTERLEAVED,
    &timing::SERPENTINE,
    &timing::HALVES,
    &readout::SINE,
    &readout::HARMONICS,
    &readout::WANDERING,
    &readout::COARSE_STEPS,
    &converter::MISSING_CODES,
    &converter::UNEVEN_STEPS,
    &converter::COMPANDED,
    &outside::SUPPLY_DROOP,
    &outside::DRAGGED_SPREAD,
    &outside::STICK_SLIP,
    &outside::ADHESION,
    &outside::CONVERTER_RIPPLE,
    &outside::RINGING,
    &outside::STAGE_PICKUP,
    &outside::PROXIMITY,
    &outside::GROUNDING,
    &outside::ELECTRODE_TEXTURE,
    &outside::BULGE,
    &skin::AIR_POCKET,
    &skin::GRIT,
    &skin::TAUT_SHEET,
    &skin::VIBRATING_TABLE,
    &surroundings::ARM_SHADOW,
    &surroundings::COMMON_MODE,
    &surroundings::GAIN_FLICKER,
    &surroundings::ROW_BURSTS,
    &surroundings::FRAME_TEARING,
    &surroundings::BIT_FLIPS,
    &surroundings::CONTACT_HUM,
    &surroundings::STATIC_CHARGE,
    &surroundings::RANGE_SWITCH,
];

impl Definition {
    /// Finds a physics by its id.
    pub fn find(id: &str) -> Option<&'static Self> {
        CATALOGUE.iter().copied().find(|definition| definition.id == id)
    }
}

/// The state at one instant, as hidden physics sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    pub(crate) t_s: f64,
    /// Since the previous step; 0 at the first.
    pub(crate) dt_s: f64,
    /// Velocity of the tip, robot frame.
    pub(crate) velocity_mm_per_s: [f64; 3],
    pub(crate) temperature_c: f64,
    /// Where the tool is; complete after the hooks on the path and the touch.
    pub(crate) touch: Touch,
}

/// The tool's position relative to the covering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Touch {
    /// Sensor frame.
    pub(crate) point_mm: [f64; 2],
    /// Depth below the surface; negative above it.
    pub(crate) depth_mm: f64,
}

/// The tool's face and the spread of the covering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tool {
    pub(crate) diameter_mm: f64,
    /// Rise of the face per mm along the sensor's x and y.
    pub(crate) lean: [f64; 2],
    /// Spread along the sensor's x and y.
    pub(crate) sigma_mm: [f64; 2],
}

type OnPath = Box<dyn FnMut(&Now, &dyn Path, &mut [f64; 3]) + Send>;
type OnTouch = Box<dyn FnMut(&Now, &mut Touch) + Send>;
type OnTool = Box<dyn FnMut(&Now, &mut Tool) + Send>;
type OnElements = Box<dyn FnMut(&Now, &mut [f64]) + Send>;
type OnCount = Box<dyn Fn(f64) -> f64 + Send>;

/// Where in the pipeline a physics acts, with its function; in the order of action.
pub(crate) enum PipelineHook {
    /// Changes the tip's position, robot frame.
    Path(OnPath),
    /// Changes the tool's position relative to the covering.
    Touch(OnTouch),
    /// Changes the tool's face and the spread.
    Tool(OnTool),
    /// Changes the equivalent indentation of every element, mm.
    Covering(OnElements),
    /// Changes the signal of every element above its baseline, counts.
    Element(OnElements),
    /// Changes the reading of every element, counts.
    Readout(OnElements),
    /// Changes one reading with its noise, before the declared converter.
    Converter(OnCount),
}

impl PipelineHook {
    fn path(f: impl FnMut(&Now, &dyn Path, &mut [f64; 3]) + Send + 'static) -> Self {
        Self::Path(Box::new(f))
    }
    fn touch(f: impl FnMut(&Now, &mut Touch) + Send + 'static) -> Self {
        Self::Touch(Box::new(f))
    }
    fn tool(f: impl FnMut(&Now, &mut Tool) + Send + 'static) -> Self {
        Self::Tool(Box::new(f))
    }
    fn covering(f: impl FnMut(&Now, &mut [f64]) + Send + 'static) -> Self {
        Self::Covering(Box::new(f))
    }
    fn element(f: impl FnMut(&Now, &mut [f64]) + Send + 'static) -> Self {
        Self::Element(Box::new(f))
    }
    fn readout(f: impl FnMut(&Now, &mut [f64]) + Send + 'static) -> Self {
        Self::Readout(Box::new(f))
    }
    fn converter(f: impl Fn(f64) -> f64 + Send + 'static) -> Self {
        Self::Converter(Box::new(f))
    }

    /// A covering that responds as if the tool were at another depth: the image keeps its shape.
    fn depth(mut f: impl FnMut(&Now, f64) -> f64 + Send + 'static) -> Self {
        Self::covering(move |now, indentation_mm| {
            let depth_mm = now.touch.depth_mm.max(0.0);
            // Called out of contact too, so that it notices the release.
            let effective_mm = f(now, depth_mm).max(0.0);
            if depth_mm > 0.0 {
                scale(indentation_mm, effective_mm / depth_mm);
            }
        })
    }

    /// Applies a function to each element's signal or indentation.
    fn each(f: impl Fn(f64) -> f64 + Send + 'static) -> OnElements {
        Box::new(move |_, values| values.iter_mut().for_each(|value| *value = f(*value)))
    }
}

/// Makes the parameters of one physics from its strength, its sensor and random numbers. Every parameter with a name
/// is kept for the label.
pub(crate) struct Knobs<'a> {
    pub(crate) sensor: &'a Simulator,
    strength: f64,
    shape: ChaCha8Rng,
    seed: u64,
    run: u64,
    drawn: Vec<(String, f64)>,
}

impl<'a> Knobs<'a> {
    pub(crate) fn new(dose: &Dose, sensor: &'a Simulator, run: u64) -> Self {
        let Dose { strength, seed, .. } = *dose;
        Self { sensor, strength, shape: ChaCha8Rng::seed_from_u64(seed), seed, run, drawn: Vec::new() }
    }

    /// The named parameters.
    pub(crate) fn into_drawn(self) -> Vec<(String, f64)> {
        self.drawn
    }

    /// A parameter proportional to strength.
    fn scaled(&mut self, name: &str, at_one: f64) -> f64 {
        self.keep(name, self.strength * at_one)
    }

    /// A parameter inversely proportional to strength: `at_one / strength`, at most 1e30.
    fn shrinking(&mut self, name: &str, at_one: f64) -> f64 {
        // JSON has no infinity; here 1e30 has the same effect.
        self.keep(name, (at_one / self.strength).min(1e30))
    }

    /// A share proportional to strength, at most 1.
    fn share(&mut self, name: &str, at_one: f64) -> f64 {
        self.keep(name, (self.strength * at_one).min(1.0))
    }

    /// A parameter of the shape, uniform between two values.
    fn between(&mut self, name: &str, least: f64, greatest: f64) -> f64 {
        let value = self.shape.random_range(least..greatest);
        self.keep(name, value)
    }

    /// A parameter of the shape, uniform on a logarithmic scale.
    fn decade(&mut self, name: &str, least: f64, greatest: f64) -> f64 {
        let value = self.shape.random_range(least.ln()..greatest.ln()).exp();
        self.keep(name, value)
    }

    /// -1 or 1, at random.
    fn sign(&mut self, name: &str) -> f64 {
        let value = if self.shape.random() { 1.0 } else { -1.0 };
        self.keep(name, value)
    }

    /// A random unit vector in the plane.
    fn direction(&mut self, name: &str) -> [f64; 2] {
        let (sin, cos) = self.between(name, 0.0, 360.0).to_radians().sin_cos();
        [cos, sin]
    }

    /// `count` different random elements of the array.
    fn several(&mut self, name: &str, count: usize) -> Vec<usize> {
        let mut elements: Vec<usize> = (0..self.elements()).collect();
        elements.shuffle(&mut self.shape);
        elements.truncate(count);
        for (place, element) in elements.iter().enumerate() {
            self.keep(&format!("{name}_{place}"), *element as f64);
        }
        elements
    }

    /// A random element of the array.
    fn which(&mut self, name: &str) -> usize {
        let element = self.shape.random_range(0..self.elements());
        self.keep(name, element as f64);
        element
    }

    /// One number per element, uniform between two values; not kept for the label.
    fn per_element(&mut self, least: f64, greatest: f64) -> Vec<f64> {
        (0..self.elements()).map(|_| self.shape.random_range(least..greatest)).collect()
    }

    /// Random numbers for processes in time; different in each run.
    fn rng(&self) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.run + 1);
        rng
    }

    fn elements(&self) -> usize {
        self.sensor.model.array().elements()
    }

    /// Centres of the elements, sensor frame.
    fn centres_mm(&self) -> Vec<[f64; 2]> {
        let array = self.sensor.model.array();
        (0..array.elements()).filter_map(|element| array.centre_mm(element)).collect()
    }

    /// Rows and columns of the array.
    fn grid(&self) -> (usize, usize) {
        let array = self.sensor.model.array();
        (array.rows(), array.cols())
    }

    /// Half the array along x and y.
    fn half_size_mm(&self) -> [f64; 2] {
        self.sensor.model.array().extent_mm().map(|[least, greatest]| (greatest - least) / 2.0)
    }

    /// Middle of the array, sensor frame.
    fn middle_mm(&self) -> [f64; 2] {
        self.sensor.model.array().extent_mm().map(|[least, greatest]| f64::midpoint(least, greatest))
    }

    fn sigma_mm(&self) -> f64 {
        self.sensor.model.psf().sigma_mm(self.sensor.covering)
    }

    fn baselines_counts(&self) -> Vec<f64> {
        self.sensor.model.response().baseline_counts.clone()
    }

    fn keep(&mut self, name: &str, value: f64) -> f64 {
        self.drawn.push((name.to_owned(), value));
        value
    }
}

/// The share that an exponential decay leaves after a time.
fn left(dt_s: f64, time_constant_s: f64) -> f64 {
    (-dt_s / time_constant_s).exp()
}

/// Multiplies every value by `by`.
fn scale(values: &mut [f64], by: f64) {
    for value in values {
        *value *= by;
    }
}

/// Adds `by` to every value.
fn shift(values: &mut [f64], by: f64) {
    for value in values {
        *value += by;
    }
}

/// `p - q`.
fn minus([px, py]: [f64; 2], [qx, qy]: [f64; 2]) -> [f64; 2] {
    [px - qx, py - qy]
}

/// Scalar product.
fn dot([px, py]: [f64; 2], [qx, qy]: [f64; 2]) -> f64 {
    px * qx + py * qy
}

#[cfg(test)]
#[path = "physics_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "foreign_tests.rs"]
mod foreign_tests;
