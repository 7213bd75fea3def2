//! Runs without hardware: the embedded rig, and the service's core under random faults and for days.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod days;
mod embedded;
mod rehearsal;
mod schedules;

use std::collections::BTreeMap;
use std::sync::Arc;

use tactus_engine::{Engine, RunOrder};
use tactus_plan::{Arguments, InThisProcess, RigView, Script, ScriptLimits};

/// A run of a script on an engine's rig, evaluated in this process.
fn order(engine: &Engine, run_id: String, text: &str) -> RunOrder {
    let script = Script::parse("test", text).unwrap();
    let arguments = Arguments::default().resolve(&script, &RigView::of(&engine.rig())).unwrap();
    RunOrder {
        run_id,
        script,
        arguments,
        seed: 1,
        who: "test".into(),
        limits: ScriptLimits::default(),
        earlier: None,
        planned: None,
        versions: BTreeMap::new(),
        recording: String::new(),
        resets: false,
        evaluator: Arc::new(InThisProcess),
    }
}
