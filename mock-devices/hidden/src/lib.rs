//! Hidden physics: what simulated sensors do that the base model does not know.
//!
//! It shares no code with the effect library and uses other functional forms: relaxation is a Prony series of three
//! terms, a power law or a logarithm; hysteresis is Prandtl-Ishlinskii, Preisach or Bouc-Wen. Some physics has no
//! counterpart in the library ([`Definition::effect`] is `None`).
//!
//! [`CATALOGUE`] lists every physics. A [`Dose`] is one of them at a strength, with a seed for its shape. A [`HiddenSensor`]
//! follows a path as the base model does, with doses in it. A [`RandomRig`] is a rig drawn from a seed to put doses in.
//!
//! ```
//! use tactus_hidden::{RandomRig, Climate, Definition, Dose, HiddenSensor};
//!
//! let base = RandomRig::new(7)?;
//! let physics = Definition::find("relaxation-prony").ok_or("the catalogue has it")?;
//! let dose = Dose { physics, strength: 1.0, seed: 3 };
//! let mut sensor = HiddenSensor::new(&base.sensor, &[dose], Climate::new(7), 0);
//! let [x, y] = base.rig.registration.to_robot([8.0, 6.0]);
//! let counts = sensor.step(0.0, &[x, y, -0.5]);
//! assert!(counts.iter().any(|count| *count > 200.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod climate;
mod drafts;
mod physics;
mod random_rig;
mod sensor;

pub use climate::Climate;
pub use drafts::DraftTruth;
pub use physics::{CATALOGUE, Definition, Dose, STRENGTH_MAX};
pub use random_rig::RandomRig;
pub use sensor::HiddenSensor;
