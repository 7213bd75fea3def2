//! Drafts: effects that no class of the library names, as data.
//!
//! ```text
//! carrier_e  +=  strength  curve(c_1, c_2)  weight_e          where the draft acts: in contact, out of it, or always
//! ```
//!
//! `tactus discover` writes one where something is left that no class explains. A [`Draft`] says where in the pipeline it acts and what it
//! adds to (its [`Carrier`]), on which one or two [`Covariate`]s that depends, and by which [`Law`]. It becomes an effect like any other by
//! [`Draft::define`], with these parameters:
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `strength` | - | 0 | -10 to 10 | 1 as it was drafted |
//! | `quadrature` | - | 0 | -10 to 10 | of a tone by time or travel: how much of it there is a quarter of a period ahead; its phase is that of a run |
//!
//! Covariates are held within the range that the data had; beyond it the curve keeps its last value. A tone goes on.
//!
//! | carrier | stage | the curve is |
//! |---|---|---|
//! | `depth`, `x`, `y` | motion | how much deeper or further aside the tip stands, in mm |
//! | `own signal` | covering, element | a share of each element's own signal |
//! | `neighbours` | covering | a share of the mean signal of the up to four elements beside it |
//! | `every element` | covering | a signal in mm, alike for all elements |
//! | `press here`, `press there` | covering | the signal of a press so many mm deep under the tip, or at the last pressed place |
//! | `counts` | readout | counts |

use std::sync::Mutex;

use super::crosstalk::NEAREST;
use super::definition::{Definition, EffectError, Make, Parameter, PipelineStage};
use super::stage::{BaseModel, Load, Now, OnCovering, OnElement, OnMotion, OnReadout, TipState};
use super::table::between;
use super::{REGISTRY, Values};
use crate::trace::{Covariate, Seen, Trace};
use crate::{Array, Contact};

/// An effect as data.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Its name: small letters, digits and hyphens, and none of the library's.
    pub name: String,
    /// What it is, in one sentence.
    pub sentence: String,
    /// What it adds to.
    pub carrier: Carrier,
    /// When it acts.
    pub when: When,
    /// What the curve is a function of: one covariate or two.
    pub covariates: Vec<Covariate>,
    /// The range of each in the data.
    pub ranges: Vec<[f64; 2]>,
    /// The curve.
    pub law: Law,
    /// A weight for each element; `None` if it acts on all alike.
    pub weights: Option<Vec<f64>>,
}

/// What a draft adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the module says what each is")]
pub enum Carrier {
    Depth,
    X,
    Y,
    OwnSignal,
    Neighbours,
    EveryElement,
    PressHere,
    PressThere,
    Counts,
}

/// When a draft acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub enum When {
    Always,
    InContact,
    OutOfContact,
    /// Out of contact, after a move down or sideways and not up.
    OnTheWayDown,
    OnTheWayUp,
}

/// A curve of one covariate `x`, or a table of one or two.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the formula says what each is")]
pub enum Law {
    /// `offset + slope x`
    Linear { offset: f64, slope: f64 },
    /// `scale x^exponent`, 0 below 0
    Power { scale: f64, exponent: f64 },
    /// `scale exp(-x / length)`
    Exponential { scale: f64, length: f64 },
    /// `scale (1 - exp(-x / length))`
    Saturating { scale: f64, length: f64 },
    /// `scale` from `at` on, before it 0
    Threshold { scale: f64, at: f64 },
    /// `offset + sine sin(2 pi per_unit x) + cosine cos(2 pi per_unit x)`
    Periodic { offset: f64, sine: f64, cosine: f64, per_unit: f64 },
    /// `scale ln(1 + x / length)`
    Logarithm { scale: f64, length: f64 },
    /// Straight lines between places, for two covariates on a grid: the last one's values follow each other.
    Table { at: Vec<Vec<f64>>, values: Vec<f64> },
}

/// Depth of the press whose image the carriers of places take, in mm.
const LOOK_MM: f64 = 0.3;
/// Greatest number of values of a table.
const TABLE_MAX: usize = 1024;

static PARAMETERS: [Parameter; 2] =
    [Parameter::real("strength", 0.0, [-10.0, 10.0]), Parameter::real("quadrature", 0.0, [-10.0, 10.0])];
/// The drafts of this process. There are few, and effects refer to their definitions for as long as it runs.
static DEFINED: Mutex<Vec<&'static Definition>> = Mutex::new(Vec::new());

impl Carrier {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Depth,
        Self::X,
        Self::Y,
        Self::OwnSignal,
        Self::Neighbours,
        Self::EveryElement,
        Self::PressHere,
        Self::PressThere,
        Self::Counts,
    ];

    /// Where in the pipeline a draft acts that depends on these: what depends on signals alone acts in the elements.
    pub fn stage(self, covariates: &[Covariate]) -> PipelineStage {
        match self {
            Self::Depth | Self::X | Self::Y => PipelineStage::Motion,
            Self::OwnSignal if covariates.iter().copied().all(Covariate::needs_signals) => {
                PipelineStage::Element
            }
            Self::OwnSignal | Self::Neighbours | Self::EveryElement | Self::PressHere | Self::PressThere => {
                PipelineStage::Covering
            }
            Self::Counts => PipelineStage::Readout,
        }
    }

    /// The name in draft files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::X => "x",
            Self::Y => "y",
            Self::OwnSignal => "own signal",
            Self::Neighbours => "neighbours",
            Self::EveryElement => "every element",
            Self::PressHere => "press here",
            Self::PressThere => "press there",
            Self::Counts => "counts",
        }
    }

    /// The unit of the curve.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::OwnSignal | Self::Neighbours => "share",
            Self::Counts => "counts",
            Self::Depth | Self::X | Self::Y | Self::EveryElement | Self::PressHere | Self::PressThere => "mm",
        }
    }
}

impl When {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Always, Self::InContact, Self::OutOfContact, Self::OnTheWayDown, Self::OnTheWayUp];

    /// The name in draft files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Always => "always",
            Self::InContact => "in contact",
            Self::OutOfContact => "out of contact",
            Self::OnTheWayDown => "on the way down",
            Self::OnTheWayUp => "on the way up",
        }
    }

    /// True if a draft acts at this point of the history.
    pub fn is_now(self, trace: &Trace) -> bool {
        let is_deep = trace.depth_mm > 0.0;
        match self {
            Self::Always => true,
            Self::InContact => is_deep,
            Self::OutOfContact => !is_deep,
            Self::OnTheWayDown => !is_deep && !trace.is_upward,
            Self::OnTheWayUp => !is_deep && trace.is_upward,
        }
    }
}

impl Law {
    /// The name in draft files.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Linear { .. } => "linear",
            Self::Power { .. } => "power",
            Self::Exponential { .. } => "exponential",
            Self::Saturating { .. } => "saturating",
            Self::Threshold { .. } => "threshold",
            Self::Periodic { .. } => "periodic",
            Self::Logarithm { .. } => "logarithm",
            Self::Table { .. } => "table",
        }
    }

    /// Its numbers by name; those of a table are its places and values.
    pub fn numbers(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Self::Linear { offset, slope } => vec![("offset", offset), ("slope", slope)],
            Self::Power { scale, exponent } => vec![("scale", scale), ("exponent", exponent)],
            Self::Exponential { scale, length }
            | Self::Saturating { scale, length }
            | Self::Logarithm { scale, length } => vec![("scale", scale), ("length", length)],
            Self::Threshold { scale, at } => vec![("scale", scale), ("at", at)],
            Self::Periodic { offset, sine, cosine, per_unit } => {
                vec![("offset", offset), ("sine", sine), ("cosine", cosine), ("per_unit", per_unit)]
            }
            Self::Table { .. } => Vec::new(),
        }
    }

    /// The law of a name with its numbers; `None` if there is no such law of one covariate, or a number is missing or left over.
    pub fn of_numbers(name: &str, numbers: &[(&str, f64)]) -> Option<Self> {
        let number = |key: &str| numbers.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
        let law = match name {
            "linear" => Self::Linear { offset: number("offset")?, slope: number("slope")? },
            "power" => Self::Power { scale: number("scale")?, exponent: number("exponent")? },
            "exponential" => Self::Exponential { scale: number("scale")?, length: number("length")? },
            "saturating" => Self::Saturating { scale: number("scale")?, length: number("length")? },
            "logarithm" => Self::Logarithm { scale: number("scale")?, length: number("length")? },
            "threshold" => Self::Threshold { scale: number("scale")?, at: number("at")? },
            "periodic" => Self::Periodic {
                offset: number("offset")?,
                sine: number("sine")?,
                cosine: number("cosine")?,
                per_unit: number("per_unit")?,
            },
            _ => return None,
        };
        (law.numbers().len() == numbers.len()).then_some(law)
    }

    /// What must be otherwise, for so many covariates.
    fn check(&self, count: usize) -> Result<(), String> {
        let numbers = self.numbers();
        if let Some((name, value)) = numbers.iter().find(|(_, value)| !value.is_finite()) {
            return Err(format!("{name} must be finite, not {value}"));
        }
        if numbers.iter().any(|(name, value)| *name == "length" && *value <= 0.0) {
            return Err("length must be above 0".into());
        }
        let Self::Table { at, values } = self else {
            return if count == 1 { Ok(()) } else { Err("two covariates need a table".into()) };
        };
        let size: usize = at.iter().map(Vec::len).product();
        if at.len() != count || size != values.len() || !(1..=TABLE_MAX).contains(&size) {
            return Err(format!(
                "a table must have places for each covariate, and 1 to {TABLE_MAX} values, one for each"
            ));
        }
        let is_ordered = |places: &Vec<f64>| {
            places.iter().all(|place| place.is_finite()) && places.windows(2).all(|two| two[0] < two[1])
        };
        if !at.iter().all(is_ordered) || values.iter().any(|value| !value.is_finite()) {
            return Err("a table must have finite places in order, and finite values".into());
        }
        Ok(())
    }

    /// Its value at one covariate, or two of a table.
    pub fn value(&self, at: &[f64]) -> f64 {
        let x = at.first().copied().unwrap_or(0.0);
        match self {
            Self::Linear { offset, slope } => offset + slope * x,
            Self::Power { scale, exponent } => scale * x.max(0.0).powf(*exponent),
            Self::Exponential { scale, length } => scale * (-x / length).exp(),
            Self::Saturating { scale, length } => -scale * (-x / length).exp_m1(),
            Self::Threshold { scale, at } => {
                if x >= *at {
                    *scale
                } else {
                    0.0
                }
            }
            Self::Periodic { offset, sine, cosine, per_unit } => {
                let (sin, cos) = (std::f64::consts::TAU * per_unit * x).sin_cos();
                offset + sine * sin + cosine * cos
            }
            Self::Logarithm { scale, length } => scale * (x / length).max(0.0).ln_1p(),
            Self::Table { at: places, values } => match (places.as_slice(), at) {
                ([only], [x, ..]) => between(only, *x, |place| values[place]),
                ([first, second], [x, y, ..]) => between(first, *x, |row| {
                    between(second, *y, |column| values[row * second.len() + column])
                }),
                _ => 0.0,
            },
        }
    }

    /// So much of it, and of a tone so much of it a quarter of a period ahead.
    #[must_use]
    pub fn turned(&self, [by, quadrature]: [f64; 2]) -> Self {
        match self.clone() {
            Self::Linear { offset, slope } => Self::Linear { offset: by * offset, slope: by * slope },
            Self::Power { scale, exponent } => Self::Power { scale: by * scale, exponent },
            Self::Exponential { scale, length } => Self::Exponential { scale: by * scale, length },
            Self::Saturating { scale, length } => Self::Saturating { scale: by * scale, length },
            Self::Threshold { scale, at } => Self::Threshold { scale: by * scale, at },
            Self::Periodic { offset, sine, cosine, per_unit } => Self::Periodic {
                offset: by * offset,
                sine: by * sine - quadrature * cosine,
                cosine: by * cosine + quadrature * sine,
                per_unit,
            },
            Self::Logarithm { scale, length } => Self::Logarithm { scale: by * scale, length },
            Self::Table { at, values } => {
                Self::Table { at, values: values.into_iter().map(|value| by * value).collect() }
            }
        }
    }
}

impl Draft {
    /// Where in the pipeline it acts.
    pub fn stage(&self) -> PipelineStage {
        self.carrier.stage(&self.covariates)
    }

    /// The draft as an effect's definition.
    ///
    /// # Errors
    /// [`EffectError::Draft`] says what is wrong with it.
    pub fn define(self) -> Result<&'static Definition, EffectError> {
        self.check()?;
        let mut defined = DEFINED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = defined.iter().find(|known| known.draft() == Some(&self)) {
            return Ok(known);
        }
        let draft: &'static Self = Box::leak(Box::new(self));
        let definition: &'static Definition = Box::leak(Box::new(Definition {
            name: &draft.name,
            summary: &draft.sentence,
            parameters: if draft.phase_is_of_a_run() { &PARAMETERS } else { &PARAMETERS[..1] },
            near_twins: &[],
            acts_by: &draft.covariates,
            shown_by: &[],
            curve: None,
            make: Make::Draft(draft),
        }));
        defined.push(definition);
        Ok(definition)
    }

    /// Checks that it is an effect.
    ///
    /// # Errors
    /// [`EffectError::Draft`] says what is wrong with it.
    pub fn check(&self) -> Result<(), EffectError> {
        self.checked().map_err(|want| EffectError::Draft { name: self.name.clone(), want })
    }

    /// What must be otherwise.
    fn checked(&self) -> Result<(), String> {
        let is_name = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
        if self.name.is_empty() || !self.name.chars().all(is_name) {
            return Err("its name must have small letters, digits and hyphens only".into());
        }
        if REGISTRY.iter().any(|known| known.name == self.name) {
            return Err("its name is that of an effect of the library".into());
        }
        let count = self.covariates.len();
        if !(1..=2).contains(&count) || self.ranges.len() != count {
            return Err("it must have one covariate or two, with a range for each".into());
        }
        if self.ranges.iter().any(|[least, most]| !(least <= most && least.is_finite() && most.is_finite())) {
            return Err("the range of a covariate must be finite, its least value first".into());
        }
        let is_motion = self.stage() == PipelineStage::Motion;
        let needs = |covariate: &&Covariate| covariate.is_of_element() || covariate.needs_signals();
        if let Some(covariate) = self.covariates.iter().find(needs).filter(|_| is_motion) {
            return Err(format!("the motion of the tip cannot depend on {:?}", covariate.name()));
        }
        if self.covariates.contains(&Covariate::Counts) && self.carrier != Carrier::Counts {
            return Err("only what is added to counts can depend on counts".into());
        }
        self.law.check(count)?;
        if self.weights.iter().flatten().any(|weight| !weight.is_finite()) {
            return Err("its weights must be finite".into());
        }
        Ok(())
    }

    /// Checks that it is of an array: that it has a weight for each element, if it has any.
    ///
    /// # Errors
    /// [`EffectError::Draft`] says how many it has.
    pub fn fits(&self, array: &Array) -> Result<(), EffectError> {
        let elements = array.elements();
        let given = self.weights.as_ref().map_or(elements, Vec::len);
        (given == elements).then_some(()).ok_or_else(|| EffectError::Draft {
            name: self.name.clone(),
            want: format!("it has weights for {given} elements, and the array has {elements}"),
        })
    }

    /// True of a tone by what begins with each run, so that its phase in one says nothing of that in another.
    fn phase_is_of_a_run(&self) -> bool {
        matches!(self.law, Law::Periodic { .. })
            && matches!(self.covariates[..], [Covariate::Time | Covariate::Travel])
    }

    /// The curve at this strength, times the weight of an element; 0 where it does not act.
    fn value(&self, [strength, quadrature]: [f64; 2], seen: Seen<'_>, element: usize) -> f64 {
        let mut at = [0.0; 2];
        for ((at, covariate), [least, most]) in at.iter_mut().zip(&self.covariates).zip(&self.ranges) {
            let Some(value) = covariate.value(seen, element) else { return 0.0 };
            let goes_on = matches!(self.law, Law::Periodic { .. });
            *at = if goes_on { value } else { value.clamp(*least, *most) };
        }
        let weight = self.weights.as_ref().map_or(1.0, |weights| weights[element]);
        let mut value = strength * self.law.value(&at[..self.covariates.len()]);
        if quadrature != 0.0 {
            value += quadrature * self.law.turned([0.0, 1.0]).value(&at[..1]);
        }
        weight * value
    }

    /// True if every element sees the same.
    fn is_common(&self) -> bool {
        self.weights.is_none() && !self.covariates.iter().any(|covariate| covariate.is_of_element())
    }
}

/// A draft in a pipeline.
#[derive(Debug)]
pub(crate) struct Drafted {
    draft: &'static Draft,
    /// Its strength, and of a tone its quadrature.
    strength: [f64; 2],
    trace: Trace,
    values: Vec<f64>,
    /// The image of the press that a carrier takes, and the place and width of what it is of.
    image_mm: Vec<f64>,
    image_of: Option<([f64; 2], f64)>,
}

impl Drafted {
    pub(crate) fn of(draft: &'static Draft, values: &Values) -> Self {
        Self {
            draft,
            strength: [values[0], if draft.phase_is_of_a_run() { values[1] } else { 0.0 }],
            trace: Trace::default(),
            values: Vec::new(),
            image_mm: Vec::new(),
            image_of: None,
        }
    }

    fn is_neutral(&self) -> bool {
        self.strength.iter().all(|part| *part == 0.0)
    }

    /// Takes the moment. True if the draft acts in it; then `values` has what it adds to the carrier of each element.
    fn acts(&mut self, now: Now<'_>, contact: Option<&Contact>, signal_mm: &[f64], counts: &[f64]) -> bool {
        let Some(contact) = contact else { return false };
        self.trace.take(now.t_s, contact.position_mm, contact.depth_mm, now.temperature_c);
        if self.is_neutral() || !self.draft.when.is_now(&self.trace) {
            return false;
        }
        let array = now.base.model.array();
        let seen = Seen { trace: &self.trace, array, signal_mm, counts };
        let (draft, strength) = (self.draft, self.strength);
        self.values.clear();
        if draft.is_common() {
            self.values.resize(array.elements(), draft.value(strength, seen, 0));
        } else {
            self.values.extend((0..array.elements()).map(|element| draft.value(strength, seen, element)));
        }
        true
    }

    /// The image of a press at a place, per mm of its depth.
    fn press(&mut self, base: BaseModel<'_>, contact: &Contact, place_mm: [f64; 2]) {
        let sigma_mm = base.sigma_mm();
        if self.image_of == Some((place_mm, sigma_mm)) {
            return;
        }
        self.image_of = Some((place_mm, sigma_mm));
        self.image_mm.resize(base.model.array().elements(), 0.0);
        let contact = Contact { position_mm: place_mm, depth_mm: LOOK_MM, ..contact.clone() };
        let load = Load { weight: 1.0, contact, lean: [0.0; 2], sigma_mm: [sigma_mm; 2] };
        base.model.indentation_of(&load, base.covering, &mut self.image_mm);
        self.image_mm.iter_mut().for_each(|signal| *signal /= LOOK_MM);
    }
}

impl OnMotion for Drafted {
    fn place(&mut self, now: Now<'_>, tip: &mut TipState) {
        let [_, _, z_mm] = tip.tip_mm;
        let depth_mm = tip.surface_mm - z_mm;
        self.trace.take(now.t_s, tip.position_mm(), depth_mm, now.temperature_c);
        if self.is_neutral() || !self.draft.when.is_now(&self.trace) {
            return;
        }
        let seen = Seen { trace: &self.trace, array: now.base.model.array(), signal_mm: &[], counts: &[] };
        let by_mm = self.draft.value(self.strength, seen, 0);
        if self.draft.carrier == Carrier::X {
            shift(tip, [by_mm, 0.0]);
        } else if self.draft.carrier == Carrier::Y {
            shift(tip, [0.0, by_mm]);
        } else {
            tip.surface_mm += by_mm;
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.trace = Trace::default();
    }
}

/// Moves the tip in the sensor's plane.
fn shift(tip: &mut TipState, by_mm: [f64; 2]) {
    let on_sensor = tip.position_mm();
    let moved = tip.registration.to_robot([on_sensor[0] + by_mm[0], on_sensor[1] + by_mm[1]]);
    (tip.tip_mm[0], tip.tip_mm[1]) = (moved[0], moved[1]);
}

impl OnCovering for Drafted {
    fn signal(&mut self, now: Now<'_>, contact: &Contact, signal_mm: &mut [f64]) {
        if !self.acts(now, Some(contact), signal_mm, &[]) {
            return;
        }
        match self.draft.carrier {
            Carrier::OwnSignal => {
                signal_mm.iter_mut().zip(&self.values).for_each(|(u, share)| *u += share * *u);
            }
            Carrier::Neighbours => {
                let array = now.base.model.array();
                let means = means_of_neighbours([array.rows(), array.cols()], signal_mm);
                for ((u, share), mean) in signal_mm.iter_mut().zip(&self.values).zip(means) {
                    *u += share * mean;
                }
            }
            Carrier::PressHere | Carrier::PressThere => {
                let is_here = self.draft.carrier == Carrier::PressHere;
                let place = if is_here { Some(contact.position_mm) } else { self.trace.last_place_mm };
                let Some(place_mm) = place else { return };
                self.press(now.base, contact, place_mm);
                for ((u, by_mm), image) in signal_mm.iter_mut().zip(&self.values).zip(&self.image_mm) {
                    *u += by_mm * image;
                }
            }
            Carrier::Depth | Carrier::X | Carrier::Y | Carrier::EveryElement | Carrier::Counts => {
                signal_mm.iter_mut().zip(&self.values).for_each(|(u, by_mm)| *u += by_mm);
            }
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.trace = Trace::default();
    }
}

impl OnElement for Drafted {
    fn signal(&mut self, now: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
        if self.acts(now, now.contact, signal_mm, &[]) {
            signal_mm.iter_mut().zip(&self.values).for_each(|(u, share)| *u += share * *u);
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.trace = Trace::default();
    }
}

impl OnReadout for Drafted {
    fn counts(&mut self, now: Now<'_>, counts: &mut [f64]) {
        if self.acts(now, now.contact, now.signal_mm, counts) {
            counts.iter_mut().zip(&self.values).for_each(|(counts, by)| *counts += by);
        }
    }

    fn remembers(&self) -> bool {
        true
    }

    fn reset(&mut self) {
        self.trace = Trace::default();
    }
}

/// For each element the mean of the up to four nearest.
fn means_of_neighbours([rows, cols]: [usize; 2], values: &[f64]) -> Vec<f64> {
    let of = |element: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        NEAREST.visit([rows, cols], element, |other, weight| {
            sum += weight * values[other];
            count += weight;
        });
        sum / f64::max(count, 1.0)
    };
    (0..values.len()).map(of).collect()
}

#[cfg(test)]
#[path = "draft_tests.rs"]
mod tests;
