//! Test data for discovery: measurement tables of sensors with hidden physics, and their labels.
//!
//! A [`Recipe`] makes a whole [`DataSet`]: the measurement table of an experiment ([`plan`]) on a random rig with noise and
//! with physics of `tactus-hidden`, and the [`Label`] that names this physics. The table contains nothing of the label.
//!
//! ```
//! use tactus_sets::{Content, NoiseKind, Plan, Recipe};
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
//! # Ok::<(), tactus_sets::RecipeError>(())
//! ```

pub mod plan;

mod anew;
mod label;
mod nearest;
mod noise;
mod oracle;
mod recipe;
mod separation;
mod set;

pub use label::{Label, PhysicsLabel};
pub use nearest::ClassFits;
pub use noise::{Noise, NoiseKind};
pub use plan::Plan;
pub use recipe::{Amount, Content, Recipe, RecipeError};
pub use separation::Separation;
pub use set::DataSet;
