//! The functions that experiment scripts call.

mod arguments;
mod arithmetic;
mod parameters;
mod sequences;
mod steps;
mod values;

use starlark::environment::{Globals, GlobalsBuilder};

pub(crate) use values::{rig_value, to_json};

/// Parameters, steps, random numbers and arithmetic.
pub(crate) fn globals() -> Globals {
    GlobalsBuilder::new()
        .with(parameters::functions)
        .with(steps::functions)
        .with(sequences::functions)
        .with(arithmetic::functions)
        .build()
}

/// The functions that experiment scripts can call beyond the language's own, as Starlark with documentation.
pub fn reference() -> String {
    globals().documentation().render_as_code()
}

#[cfg(test)]
#[path = "builtins_tests.rs"]
mod tests;
