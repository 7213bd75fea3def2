//! Effects: named, physical departures from the base model, each a stage of the one pipeline.
//!
//! ```text
//! motion -> contact -> covering -> element -> readout
//! ```
//!
//! An [`Effect`] is a [`Definition`] with a value for each of its parameters. What it does is one object behind
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
//! are listed. History lives in the effect and is forgotten by `reset`. Between two moments an effect with memory
//! takes its input as a straight line, so that a call more often changes nothing for such an input. At neutral
//! parameters an effect changes nothing, to the bit.
//!
//! **Derivatives.** Where a closed form exists, `slope` gives the derivative of the effect's own output by one of
//! its parameters at the same input, with that of the memory; `None` or `false` where there is none. From there to
//! counts: a [`Shift`] of the contact through [`ForwardModel::gradient`](crate::ForwardModel::gradient), a
//! change of signal times `sensitivity (1 + 2 k u)`, a change of counts as it is, as long as no effect stands
//! behind. Else two pipelines are differenced: [`Effect::with`] makes the other one.
//!
//! **There are**, in [`REGISTRY`]: `misregistration`, `surface-offset`, `surface-tilt`, `indenter-size`,
//! `hardening`, `heavy-tail`, `relaxation`, `crosstalk`, `miswired`, `low-pass`, `quantisation`. These names are a
//! contract of reports and model files. The design's table names the rest.
//!
//! **A lab's own effect** is one file of the kind below and one line in the registry; or, without touching this
//! crate, a `static` [`Definition`] given to [`Effect::of`].
//!
//! ```
//! use tactus_model::effect::{Base, Definition, Make, OnElement, Parameter};
//! use tactus_model::Effect;
//!
//! /// Elements lose a share of their signal: `u -> (1 - lost_share) u`.
//! static LOSS: Definition = Definition {
//!     name: "loss",
//!     summary: "every element loses a share of its signal",
//!     parameters: &[Parameter::real("lost_share", 0.0, [0.0, 1.0])],
//!     near_twins: &[],
//!     shown_by: &["element-centres"],
//!     make: Make::Element(|values| Box::new(Loss { lost_share: values[0] })),
//! };
//!
//! #[derive(Debug)]
//! struct Loss {
//!     lost_share: f64,
//! }
//!
//! impl OnElement for Loss {
//!     fn signal(&self, _: Base<'_>, _: &[f64], signal_mm: &mut [f64]) {
//!         signal_mm.iter_mut().for_each(|u| *u *= 1.0 - self.lost_share);
//!     }
//! }
//!
//! let effect = Effect::of(&LOSS, [("lost_share", 0.1)])?;
//! # Ok::<(), tactus_model::effect::EffectError>(())
//! ```

#[cfg(test)]
pub(crate) mod bench;
mod crosstalk;
mod definition;
mod hardening;
mod heavy_tail;
mod indenter_size;
mod lag;
mod low_pass;
mod misregistration;
mod miswired;
mod quantisation;
mod relaxation;
mod stage;
mod surface_offset;
mod surface_tilt;

pub use definition::{Definition, Effect, EffectError, Kind, Make, Parameter, Stage};
pub use stage::{Base, Now, OnContact, OnCovering, OnElement, OnMotion, OnReadout, Place, Press, Shift};

/// Every effect of the library, in the order of the stages.
pub static REGISTRY: &[&Definition] = &[
    &misregistration::DEFINITION,
    &surface_offset::DEFINITION,
    &surface_tilt::DEFINITION,
    &indenter_size::DEFINITION,
    &hardening::DEFINITION,
    &heavy_tail::DEFINITION,
    &relaxation::DEFINITION,
    &crosstalk::DEFINITION,
    &miswired::DEFINITION,
    &low_pass::DEFINITION,
    &quantisation::DEFINITION,
];
