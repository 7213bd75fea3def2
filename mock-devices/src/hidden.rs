//! Hidden physics: what simulated sensors do that the base model does not know.
//!
//! Test data for discovery. It is written apart from the effect library and in other functional forms: a relaxation
//! here is a Prony series of three terms, a power law or a logarithm; hysteresis is Prandtl-Ishlinskii, Preisach or
//! Bouc-Wen. Some physics has no counterpart in the library at all ([`Definition::effect`] is `None`).
//!
//! [`CATALOGUE`] lists every physics. A [`Dose`] is one of them at a strength, with a seed for its shape. A [`Sensor`]
//! follows a path as the base model does, with doses in it. A [`Recipe`] makes a whole [`Set`]: the measurement table
//! of an experiment ([`plan`]) on a sensor of its own, with noise, and apart from it the [`Label`] that says what is in
//! it. The table tells nothing of the label.
//!
//! ```
//! use tactus_mock::hidden::{Content, NoiseKind, Plan, Recipe};
//!
//! let recipe = Recipe {
//!     plan: Plan::Bundle,
//!     frames: Some(600),
//!     noise: NoiseKind::White,
//!     content: Content { physics: vec!["relaxation-prony".into()], ..Content::default() },
//!     ..Recipe::new(7)
//! };
//! let set = recipe.make()?;
//! assert_eq!(set.rows.len(), 600);
//! assert_eq!(set.label.effects(), ["relaxation"]);
//! # Ok::<(), tactus_mock::hidden::HiddenError>(())
//! ```

pub mod plan;

mod base;
mod label;
mod noise;
mod physics;
mod recipe;
mod sensor;
mod separation;
mod set;

pub(crate) mod cli;

pub use base::{Base, Climate};
pub use label::{Dosed, Label};
pub use noise::{Noise, NoiseKind};
pub use physics::{CATALOGUE, Definition, Dose};
pub use plan::Plan;
pub(crate) use recipe::STRENGTH_MAX;
pub use recipe::{Amount, Content, HiddenError, Recipe};
pub use sensor::Sensor;
pub use separation::Separation;
pub use set::Set;
