//! Experiment scripts in Starlark, evaluated into steps.
//!
//! A script declares parameters at its top level and does its work in `run(rig)`:
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
//! [`Script::parse`] reads it, [`Script::parameters`] lists its parameters, [`Arguments`] holds the values that somebody
//! chose for them, and [`execute()`] runs it. Each step that the script asks for goes to a [`Host`], whose [`Reply`] the
//! script receives. [`reference()`] lists the functions that scripts can call, and [`RigView`] shows what they see of the
//! rig. This crate moves nothing and checks no envelope; the host does both.
//!
//! # What a script cannot do
//!
//! Scripts have no `load`, no files, no network and no clock; their random numbers come from the run's seed alone. The
//! language has no `while`, and endless recursion runs into [`ScriptLimits`]:
//!
//! | bound | checked |
//! |---|---|
//! | source of 256 KiB, nested 150 deep | before parsing |
//! | loop turns and calls ([`ScriptLimits::ticks`]) | once in a thousand of them |
//! | functions under way ([`ScriptLimits::call_depth`]) | at each call |
//! | memory of values ([`ScriptLimits::heap_bytes`]) | before each statement and each `+`, `*`, `%`, `\|`; inside a comprehension once in a thousand turns |
//! | texts of 64 KiB, lists of 100,000 values, whole numbers of 64 bits | as operands or results of `+`, `*`, `%`, `\|`, `range`, `zip`, `str`, `log` |
//! | steps ([`ScriptLimits::steps`]), text of the `log` lines ([`ScriptLimits::log_bytes`]) | at each step |
//! | computing time between two steps ([`ScriptLimits::think`]), and [`Host::cancelled`] | before each statement, once in a thousand turns |
//!
//! Operations that can make a value much larger than their operands and that cannot be measured beforehand
//! (`*=`, `%=`, `.extend`, `.format`, `.join`, `.replace`) are refused when the script is parsed.
//!
//! # What only a process of its own bounds
//!
//! The evaluator is a library, and [`InThisProcess`] runs it in the caller's process. It does not withstand an attacker who
//! knows its internals. A script that is stuck inside a single operation, such as a comparison of deeply shared values, is
//! left behind one second after its time is over: the caller continues, and the script's thread computes until the
//! operation or the process ends. Three cases are not bounded, each inside one operation:
//!
//! - a comprehension that copies a long list can exceed the memory bound by some hundred copies;
//! - an error message that quotes a deeply shared value can take any amount of memory;
//! - an error message that quotes a value nested some hundred thousand deep can overflow the stack, which ends the
//!   process.
//!
//! The service and the command line therefore evaluate each script in a process of its own (`tactus_runner::script_process`),
//! which the system bounds by [`ScriptLimits::process_bytes`] and [`ScriptLimits::processor`], and which is killed when its run is
//! stopped. What goes there and back ([`Call`], [`Reply`], [`ScriptError`] and the others) is plain data.

mod arguments;
mod builtins;
mod context;
mod error;
mod evaluate;
mod evaluator;
mod execute;
mod host;
mod json_text;
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
pub use evaluator::{Evaluate, InThisProcess};
pub use execute::{Outcome, STACK_BYTES, execute};
pub use host::{Call, Host, Location, MeanReading, Refusal, Reply};
pub use limits::{Exceeded, LOG_LINE_MAX_BYTES, ScriptLimits};
pub use parameter::{Parameter, ParameterType};
pub use rig_view::{ElementView, RigView};
pub use script::Script;
pub use step::{Position, Press, Step};
