//! The functions that a script can call.

use std::sync::LazyLock;

use starlark::environment::{Globals, GlobalsBuilder};

use super::operators;
use crate::builtins;

/// Function and operator it stands for.
pub(super) const OPERATORS: [(&str, &str); 4] =
    [("plus", "+"), ("times", "*"), ("percent", "%"), ("union", "|")];

/// Standard functions that scripts may use. The others either bypass the bounds (`getattr` returns any method) or are
/// replaced by bounded ones in [`builtins`].
const STANDARD: [&str; 19] = [
    "False",
    "None",
    "True",
    "abs",
    "all",
    "any",
    "bool",
    "dict",
    "enumerate",
    "float",
    "int",
    "len",
    "list",
    "max",
    "min",
    "reversed",
    "sorted",
    "tuple",
    "type",
];

/// Built once; scripts share it.
pub(crate) static GLOBALS: LazyLock<Globals> = LazyLock::new(|| {
    let mut globals = GlobalsBuilder::new();
    let mut take = |from: &Globals, name_of: &dyn Fn(&str) -> Option<String>| {
        globals.frozen_heap().add_reference(from.heap());
        for (name, value) in from.iter() {
            if let Some(name) = name_of(name) {
                globals.set(&name, value);
            }
        }
    };
    take(&Globals::standard(), &|name| STANDARD.contains(&name).then(|| name.to_owned()));
    take(&GlobalsBuilder::new().with(operators::functions).build(), &|name| {
        OPERATORS.iter().find(|(function, _)| *function == name).map(|(_, operator)| (*operator).to_owned())
    });
    take(&builtins::globals(), &|name| Some(name.to_owned()));
    globals.build()
});
