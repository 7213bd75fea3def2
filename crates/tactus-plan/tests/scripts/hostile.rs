//! Scripts that try to take more than their share.

use std::time::Duration;

use crate::fake::FakeRig;
use tactus_plan::{
    Arguments, Call, Exceeded, Host, Refusal, Reply, Script, ScriptError, ScriptLimits, execute,
};

fn limits() -> ScriptLimits {
    ScriptLimits { ticks: 10_000, heap_bytes: 8 << 20, ..ScriptLimits::default() }
}

fn end_of(body: &str) -> Result<(), ScriptError> {
    end_within(body, &limits())
}

fn end_within(body: &str, limits: &ScriptLimits) -> Result<(), ScriptError> {
    let source = format!("def run(rig):\n    {}\n", body.trim().replace('\n', "\n    "));
    let script = Script::parse("hostile", &source)?;
    let mut rig = FakeRig::new();
    execute(&script, &Arguments::default(), &rig.view(), 1, limits, &mut rig).map(|_| ())
}

fn exceeded(body: &str) -> Exceeded {
    match end_of(body) {
        Err(ScriptError::Limit { exceeded, at, .. }) => {
            assert_eq!(at.script, "hostile");
            assert!(at.line >= 2, "{at}");
            exceeded
        }
        other => panic!("{body}: {other:?}"),
    }
}

#[test]
fn endless_loops_run_out_of_turns() {
    for body in [
        "for _ in range(100000):\n    for _ in range(100000):\n        pass",
        "x = [0 for _ in range(100000) for _ in range(100000)]",
        "x = [0 for _ in range(100000) for _ in range(100000) if False]",
        "x = {a: b for a in range(10) for b in range(100000)}",
        "l = [0]\nfor _ in range(100000):\n    l = [l]\nf = lambda n: [f2(n) for _ in range(9)]\nf2 = lambda n: [0 for _ in range(100000)]\nf(1)",
    ] {
        assert_eq!(exceeded(body), Exceeded::Ticks(10_000), "{body}");
    }
}

#[test]
fn a_list_cannot_grow_while_it_is_gone_through() {
    let error = end_of("l = [0]\nfor x in l:\n    l.append(x)").unwrap_err();
    assert!(matches!(&error, ScriptError::Evaluation { at, .. } if at.line == 4), "{error}");
}

#[test]
fn deep_recursion_runs_out_of_calls() {
    let source = "def f(n):\n    return f(n + 1)\n\ndef run(rig):\n    f(0)\n";
    let mut rig = FakeRig::new();
    let script = Script::parse("hostile", source).unwrap();
    let error = execute(&script, &Arguments::default(), &rig.view(), 1, &limits(), &mut rig).unwrap_err();
    assert!(
        matches!(&error, ScriptError::Limit { exceeded: Exceeded::CallDepth(64), at, .. } if at.line == 2),
        "{error}"
    );
}

#[test]
fn one_operation_cannot_make_a_huge_value() {
    for (body, what) in [
        ("x = 'x' * 1000000000", "a text of 1000000000 bytes, the limit is 65536"),
        ("x = 1000000000 * 'xy'", "a text of 2000000000 bytes, the limit is 65536"),
        ("x = [0] * 1000000000", "a list of 1000000000 values, the limit is 100000"),
        ("x = (0, 1) * 1000000000", "a list of 2000000000 values, the limit is 100000"),
        ("x = list(range(1000000000))", "a range of 1000000000 values, the limit is 100000"),
        ("x = zip(*([range(100000)] * 100000))", "a list of 10000000000 values, the limit is 100000"),
        ("x = '%s%s' % ('x' * 40000, 'x' * 40000)", "a text of"),
        ("x = [0]\nfor _ in range(60):\n    x = [x, x]\nlog(x)", "a text of"),
        ("x = [0]\nfor _ in range(60):\n    x = [x, x]\nstr(x)", "a text of"),
        ("x = [0]\nfor _ in range(60):\n    x = [x, x]\n'%s' % x", "a text of"),
    ] {
        let error = end_of(body).unwrap_err();
        assert!(error.to_string().contains(what), "{body}: {error}");
    }
}

#[test]
fn memory_runs_out_before_the_machines_does() {
    for body in [
        "x = 'x' * 60000\nfor _ in range(100000):\n    x += x",
        "x = [0] * 100000\nfor _ in range(100000):\n    x += x",
        "x = [[0] * 100000 for _ in range(100000)]",
        "x = []\nfor _ in range(100000):\n    x.append([0] * 10000)",
        "x = {}\nfor n in range(100000):\n    x[n] = 'x' * 10000 + str(n)",
        "x = ['x' * 60000 for _ in range(100000)]",
    ] {
        assert_eq!(exceeded(body), Exceeded::Heap(8 << 20), "{body}");
    }
}

#[test]
fn whole_numbers_do_not_grow_without_end() {
    for body in
        ["x = 3\nfor _ in range(100):\n    x = x * x", "x = 1 << 100000\nx = x * x", "x = 1 << 1000000"]
    {
        assert!(matches!(end_of(body), Err(ScriptError::Evaluation { .. })), "{body}: {:?}", end_of(body));
    }
}

#[test]
fn what_reaches_around_the_bounds_does_not_exist() {
    for name in
        ["getattr", "hasattr", "dir", "print", "repr", "load", "open", "eval", "exec", "breakpoint", "debug"]
    {
        let error = end_of(&format!("x = {name}(1)")).unwrap_err();
        assert!(error.to_string().starts_with("hostile.star:2:"), "{name}: {error}");
    }
}

#[test]
fn steps_run_out() {
    let few = ScriptLimits { steps: 10, ..limits() };
    let error = end_within("for _ in range(100):\n    log('again')", &few).unwrap_err();
    assert_eq!(error.to_string(), "hostile.star:3:9: the script asked for more than 10 steps");
}

#[test]
fn a_script_that_computes_too_long_ends() {
    let hasty = ScriptLimits { think: Duration::ZERO, ticks: u64::MAX, ..limits() };
    let error =
        end_within("for _ in range(100000):\n    for _ in range(100000):\n        pass", &hasty).unwrap_err();
    assert!(matches!(error, ScriptError::Limit { exceeded: Exceeded::Think(_), .. }), "{error}");
}

/// Performs nothing and wants the script to end.
struct Cancelled;

impl Host for Cancelled {
    fn perform(&mut self, _call: &Call) -> Result<Reply, Refusal> {
        Ok(Reply::Done)
    }

    fn cancelled(&self) -> bool {
        true
    }
}

#[test]
fn a_stopped_run_ends_a_script_that_computes() {
    let source =
        "def run(rig):\n    for _ in range(100000):\n        for _ in range(100000):\n            pass\n";
    let script = Script::parse("hostile", source).unwrap();
    let endless = ScriptLimits { ticks: u64::MAX, ..limits() };
    let view = FakeRig::new().view();
    let error = execute(&script, &Arguments::default(), &view, 1, &endless, &mut Cancelled).unwrap_err();
    assert!(matches!(error, ScriptError::Refused { refusal: Refusal::Stopped(_), .. }), "{error}");
}
