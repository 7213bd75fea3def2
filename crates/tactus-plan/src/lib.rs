//! Experiment scripts in Starlark, evaluated into steps.
//!
//! A script is a text that declares parameters at its top level and does its work in `run(rig)`:
//!
//! ```
//! use tactus_plan::Script;
//!
//! let script = Script::parse("one-press", r#"
//! """One press on each element of the first row."""
//!
//! DEPTHS_MM = param("depths_mm", default = [0.2, 0.4], doc = "depths held", unit = "mm", min = 0.01)
//!
//! def run(rig):
//!     tare()
//!     for element in shuffled([e for e in rig.elements if e.row == 0]):
//!         readings = press(element.x_mm, element.y_mm, DEPTHS_MM)
//!         log("element", element.index, "reads", readings[-1].signal[element.index], "counts")
//! "#)?;
//! assert_eq!(script.summary(), "One press on each element of the first row.");
//! # Ok::<(), tactus_plan::ScriptError>(())
//! ```
//!
//! [`Script::parse`] reads it, [`Script::parameters`] tells what can be set, [`Arguments`] are what somebody
//! set, and [`execute()`] runs it: each step that it asks for goes to a [`Host`], and what comes back is what the
//! script sees. [`reference()`] lists the functions that scripts can call, [`RigView`] what they see of the rig.
//! This crate moves nothing and checks no envelope: that is the host's part.
//!
//! # What a script cannot do
//!
//! There is no `load`, no file, no network, no clock and no source of chance but the run's seed. `while` and
//! recursion without an end do not exist in the language or run into [`Limits`]:
//!
//! | bound | looked at |
//! |---|---|
//! | source of 256 KiB, nested 150 deep | before parsing |
//! | loop turns and calls ([`Limits::ticks`]) | once in a thousand of them |
//! | functions under way ([`Limits::call_depth`]) | at each call |
//! | memory of values ([`Limits::heap_bytes`]) | before each statement and each `+`, `*`, `%`, `\|`; inside a comprehension once in a thousand turns |
//! | texts of 64 KiB, lists of 100,000 values, whole numbers of 64 bits | as operands or results of `+`, `*`, `%`, `\|`, `range`, `zip`, `str`, `log` |
//! | steps ([`Limits::steps`]) | at each step |
//! | computing time between two steps ([`Limits::think`]), and [`Host::cancelled`] | before each statement, once in a thousand turns |
//!
//! Operations that can make a value much larger than their operands and that cannot be measured beforehand
//! (`*=`, `%=`, `.extend`, `.format`, `.join`, `.replace`) are refused when the script is parsed.
//!
//! # What is not bounded
//!
//! The evaluator is a library in the caller's process and is not made against somebody who knows its inside.
//! A script runs on a thread of its own, and one that is stuck inside a single operation (comparing values that
//! share their parts over and over) is left behind a second after its time is over: the caller goes on, that
//! thread computes until the operation ends or the process does. Three things remain, all of them
//! inside one operation: a comprehension that copies a long list can pass the memory bound by some hundred
//! copies; an error whose message quotes a value that shares its parts over and over can take any memory; and one
//! that quotes a value nested some hundred thousand deep can run out of stack, which ends the process. Against
//! these only a process of its own with limits by the operating system would help; [`Call`] and [`Reply`] are
//! plain data, so that the host can stand on the other side of a pipe.

mod arguments;
mod builtins;
mod context;
mod error;
mod evaluate;
mod execute;
mod host;
mod limits;
mod parameter;
mod rig_view;
mod sandbox;
mod script;
mod script_rng;
mod step;

pub use arguments::Arguments;
pub use builtins::reference;
pub use error::ScriptError;
pub use execute::{Outcome, execute};
pub use host::{Call, Host, Location, MeanReading, Refusal, Reply};
pub use limits::{Exceeded, Limits};
pub use parameter::{Parameter, ParameterType};
pub use rig_view::{ElementView, RigView};
pub use script::Script;
pub use step::{Position, Press, Step};
