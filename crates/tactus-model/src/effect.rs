//! Effects: named, physical departures from the base model, each a stage of the one pipeline.
//!
//! ```text
//! motion -> contact -> covering -> element -> readout
//! ```
//!
//! An [`Effect`] is a [`Definition`] with a value for each of its parameters, or with knots in place of its formula. What it does is one object behind
//! the trait of its stage, and the trait says what an effect of that stage may touch:
//!
//! | stage | trait | may change |
//! |---|---|---|
//! | motion | [`OnMotion`] | the instant at which the path is looked up; tip, registration and surface |
//! | contact | [`OnContact`] | the tool and how it stands in the covering |
//! | covering | [`OnCovering`] | how presses spread; what reaches the elements |
//! | element | [`OnElement`] | the elements' signals before their response; counts after it |
//! | readout | [`OnReadout`] | counts in time; what stands before the converter |
//!
//! The [`Pipeline`](crate::Pipeline) calls the effects of a stage one after the other, in the order in which they
//! are listed. History lives in the effect; `reset` clears it. Between two moments an effect with memory takes its input as
//! a straight line, so that calls at a higher rate give the same result. At neutral parameters an effect changes nothing,
//! to the bit.
//!
//! **Knots.** The name of an effect stands for a class, and its formula is one member. Where [`Definition::curve`] allows it, an effect has
//! [`Knots`] in place of the formula: a [`FreeCurve`], held to the class by its range and by whether it may fall.
//!
//! ```
//! use tactus_model::Effect;
//! use tactus_model::effect::{Definition, Knots};
//!
//! // A stiffer layer bears from 0.2 mm on, which no power of depth is.
//! let layer = Knots { at: vec![0.2, 0.6], values: vec![0.0, 0.5] };
//! let hardening = Effect::of_knots(Definition::find("hardening")?, [("own_share", 0.0)], layer)?;
//! assert_eq!(hardening.value("exponent"), None);
//! # Ok::<(), tactus_model::effect::EffectError>(())
//! ```
//!
//! **Tables.** A parameter that [`varies`](Parameter::varies) may have, in place of one value, a [`Table`] of the tip's depth or place: a tool
//! with a rounded rim is narrower where it only touches.
//!
//! ```
//! use tactus_model::Effect;
//! use tactus_model::effect::{By, Table};
//!
//! let rim = Table { by: By::Depth, at: vec![0.0, 0.1], values: vec![0.8, 1.0] };
//! let rounded = Effect::new("indenter-size", [("ratio", 1.0)])?.with_table("ratio", rim)?;
//! assert_eq!(rounded.value("ratio"), None);
//! # Ok::<(), tactus_model::effect::EffectError>(())
//! ```
//!
//! **Drafts.** What no class explains may be an effect as data, a [`Draft`]; see there.
//!
//! **The library**, in [`REGISTRY`]; these names are a contract of reports and model files:
//!
//! | stage | effects |
//! |---|---|
//! | motion | `misregistration`, `surface-offset`, `surface-tilt`, `time-lag`, `backlash` |
//! | contact | `indenter-size`, `indenter-tilt` |
//! | covering, spread | `heavy-tail`, `anisotropic-spread`, `depth-dependent-spread` |
//! | covering, signal | `hardening`, `edge-effect`, `relaxation`, `hysteresis`, `rate-stiffening`, `imprint`, `softening` |
//! | element | `crosstalk`, `miswired`, `saturation` |
//! | readout | `baseline-drift`, `gain-drift`, `low-pass`, `scan-skew`, `periodic-interference`, `quantisation` |
//!
//! **Cost**: an image is computed when the contact changes, as without effects. `heavy-tail` computes an image for each
//! Gaussian, and an image of a leaning tool takes several times as long. Everything else takes a few operations per element and moment.
//!
//! **Another effect** joins the library as `docs/adding-an-effect.md` describes. A lab's own effect needs no change of this
//! crate: it is a `static` [`Definition`], given to [`Effect::of`].
//!
//! ```
//! use tactus_model::effect::{Definition, Make, Now, OnElement, Parameter};
//! use tactus_model::Effect;
//!
//! /// Elements lose a share of their signal: `u -> (1 - lost_share) u`.
//! static LOSS: Definition = Definition {
//!     name: "loss",
//!     summary: "every element loses a share of its signal",
//!     parameters: &[Parameter::real("lost_share", 0.0, [0.0, 1.0])],
//!     near_twins: &[],
//!     acts_by: &[],
//!     shown_by: &["element-centres"],
//!     curve: None,
//!     make: Make::Element(|values| Box::new(Loss { lost_share: values[0] })),
//! };
//!
//! #[derive(Debug)]
//! struct Loss {
//!     lost_share: f64,
//! }
//!
//! impl OnElement for Loss {
//!     fn signal(&mut self, _: Now<'_>, _: &[f64], signal_mm: &mut [f64]) {
//!         signal_mm.iter_mut().for_each(|u| *u *= 1.0 - self.lost_share);
//!     }
//! }
//!
//! let effect = Effect::of(&LOSS, [("lost_share", 0.1)])?;
//! # Ok::<(), tactus_model::effect::EffectError>(())
//! ```

mod anisotropic_spread;
mod backlash;
mod baseline_drift;
#[cfg(test)]
pub(crate) mod bench;
mod crosstalk;
mod curve;
mod definition;
mod depth_dependent_spread;
mod draft;
mod edge_effect;
mod gain_drift;
mod hardening;
mod heavy_tail;
mod hysteresis;
mod imprint;
mod indenter_size;
mod indenter_tilt;
mod knots;
mod lag;
mod low_pass;
mod misregistration;
mod miswired;
mod periodic_interference;
mod quantisation;
mod rate_stiffening;
mod relaxation;
mod saturation;
mod scan_skew;
mod softening;
mod stage;
mod surface_offset;
mod surface_tilt;
mod table;
mod time_lag;

/// The page on adding one: its last example runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/adding-an-effect.md")]
struct AddingAnEffect;

pub use definition::{Definition, Effect, EffectError, Make, Parameter, ParameterKind, PipelineStage};
pub(crate) use draft::Drafted;
pub use draft::{Carrier, Draft, Law, When};
pub use knots::{CurveKind, FreeCurve, KNOTS_MAX, Knots, Rises, Values};
pub use stage::{BaseModel, Load, Now, OnContact, OnCovering, OnElement, OnMotion, OnReadout, TipState};
pub(crate) use table::Tabled;
pub use table::{By, Table};

/// Every effect of the library, in the order of the stages.
pub static REGISTRY: &[&Definition] = &[
    &misregistration::DEFINITION,
    &surface_offset::DEFINITION,
    &surface_tilt::DEFINITION,
    &time_lag::DEFINITION,
    &backlash::DEFINITION,
    &indenter_size::DEFINITION,
    &indenter_tilt::DEFINITION,
    &hardening::DEFINITION,
    &heavy_tail::DEFINITION,
    &anisotropic_spread::DEFINITION,
    &depth_dependent_spread::DEFINITION,
    &edge_effect::DEFINITION,
    &relaxation::DEFINITION,
    &hysteresis::DEFINITION,
    &rate_stiffening::DEFINITION,
    &imprint::DEFINITION,
    &softening::DEFINITION,
    &crosstalk::DEFINITION,
    &miswired::DEFINITION,
    &saturation::DEFINITION,
    &baseline_drift::DEFINITION,
    &gain_drift::DEFINITION,
    &low_pass::DEFINITION,
    &scan_skew::DEFINITION,
    &periodic_interference::DEFINITION,
    &quantisation::DEFINITION,
];

#[cfg(test)]
#[path = "effect_tests.rs"]
mod tests;
