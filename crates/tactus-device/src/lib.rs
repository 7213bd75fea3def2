//! Sensors and stages, independent of the link that carries their bytes.
//!
//! There is one driver for sensors and one for stages. Each runs a session of `tactus-wire`
//! ([`sensor::Session`](tactus_wire::sensor::Session), [`stage::Session`](tactus_wire::stage::Session)) over a
//! [`transport`], in a task that owns the device. A driver reconnects by itself with growing pauses and names its
//! errors. It reports a move as done only when the controller stands at the target. All times are tokio's, so a
//! runtime with paused time makes them virtual.

mod backoff;
mod bus;
mod clock;
mod error;
mod inventory;
mod link;
mod sensor;
mod stage;

pub mod transport;

pub use clock::Clock;
pub use error::{DeviceError, ErrorKind};
pub use inventory::{Access, FoundDevice, Holder, inventory};
pub use sensor::{ArrayExpectation, LinkFile, LinkFileError, Sensor, SensorCodec, SensorDriver, SensorEvent};
pub use stage::{Connection, DrivenStage, Stage, StageError, StageOptions, grbl_config, zaber_config};
pub use tactus_safety::{HomingPermit, Permit, Target};
pub use tactus_wire::stage::{Controller, Setting};
