//! A script inside one operation that no check interrupts. In a process of its own: its thread goes on.

use std::time::Duration;

use tactus_plan::{
    Arguments, Call, Exceeded, Host, Refusal, Reply, RigView, Script, ScriptError, ScriptLimits, execute,
};
use tactus_schema::Rig;

struct NoHost;

impl Host for NoHost {
    fn perform(&mut self, _call: &Call) -> Result<Reply, Refusal> {
        Ok(Reply::Done)
    }

    fn cancelled(&self) -> bool {
        false
    }
}

#[test]
fn a_script_that_cannot_be_interrupted_is_left_behind() {
    // Comparing two values that share their parts takes 2^60 comparisons inside one operation.
    let source = "
def run(rig):
    a, b = [0], [0]
    for _ in range(60):
        a, b = [a, a], [b, b]
    log('now')
    x = a == b
";
    let script = Script::parse("stuck", source).unwrap();
    let rig = Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap();
    let limits = ScriptLimits { think: Duration::from_millis(100), ..ScriptLimits::default() };
    let error =
        execute(&script, &Arguments::default(), &RigView::of(&rig), 1, &limits, &mut NoHost).unwrap_err();
    assert!(matches!(error, ScriptError::Limit { exceeded: Exceeded::Think(_), .. }), "{error}");
}
