//! Sensors and stages as the service sees them, whatever carries their bytes.
//!
//! A driver pumps a sans-IO codec of `tactus-wire` over a [`Transport`](transport), in a task that
//! owns the device. It reconnects by itself with growing pauses, names its errors, and never calls
//! a move done that did not happen. All time is tokio's, so that a paused runtime makes it virtual.

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
pub use inventory::{Access, Found, Holder, inventory};
pub use sensor::{ArrayExpectation, LinkFile, LinkFileError, Sensor, SensorCodec, SensorDriver, SensorEvent};
pub use stage::{
    Connection, DrivenStage, Stage, StageError, StageOptions, Target, grbl_config, zaber_config,
};
pub use tactus_wire::stage::{Controller, Setting};
