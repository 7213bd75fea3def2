//! What a script's author is told when something is wrong.

use crate::fake::FakeRig;
use tactus_plan::{Arguments, Outcome, Refusal, Script, ScriptError, ScriptLimits, Step, execute};

fn run(source: &str) -> Result<(Outcome, FakeRig), ScriptError> {
    let script = Script::parse("bad", source)?;
    let mut rig = FakeRig::new();
    let outcome =
        execute(&script, &Arguments::default(), &rig.view(), 1, &ScriptLimits::default(), &mut rig)?;
    Ok((outcome, rig))
}

fn problem(source: &str) -> String {
    run(source).err().map_or_else(|| "done".into(), |error| error.to_string())
}

/// The body of `run`, which begins in the second line.
fn problem_in(body: &str) -> String {
    problem(&format!("def run(rig):\n    {}\n", body.replace('\n', "\n    ")))
}

#[test]
fn a_refused_step_is_told_with_its_line() {
    let error =
        run("def run(rig):\n    tare()\n    for depth in [0.2, 0.9]:\n        press(3.0, 3.0, [depth])\n")
            .unwrap_err();
    assert_eq!(error.to_string(), "bad.star:4:9: press is 0.9 mm deep, the limit is 0.7112 mm");
    assert!(matches!(error, ScriptError::Refused { refusal: Refusal::Outside(_), .. }), "{error:?}");
}

#[test]
fn the_line_is_the_innermost_of_the_script_and_the_way_there_is_kept() {
    let source =
        "def inner(depth):\n    press(3.0, 3.0, [depth])\n\ndef run(rig):\n    inner(0.2)\n    inner(0.9)\n";
    let error = run(source).unwrap_err();
    assert_eq!(error.at().map(ToString::to_string).as_deref(), Some("bad.star:2:5"));
    assert!(error.call_stack().contains("inner(0.9)"), "{}", error.call_stack());
}

#[test]
fn each_step_carries_its_line() {
    let (_, rig) =
        run("def run(rig):\n    tare()\n    press(\n        3.0,\n        3.0,\n        [0.2],\n    )\n")
            .unwrap();
    let at: Vec<_> = rig.calls.iter().map(|call| call.at.to_string()).collect();
    assert_eq!(at, ["bad.star:2", "bad.star:3"]);
}

#[test]
fn arguments_that_make_no_sense_anywhere_are_refused_before_the_host_sees_them() {
    for (body, wanted) in [
        ("press(1.0, 1.0, [])", "depths_mm is empty"),
        ("press(1.0, 1.0, 0.3)", "depths_mm must be a list of numbers, not float"),
        ("press(1.0, 1.0, [0.1, 'a'])", "depths_mm must be a list of numbers, not of string"),
        ("press(1.0, 1.0, [-0.1])", "a depth of depths_mm is -0.1, it must be greater than 0"),
        ("press(1.0, 1.0, [0.1], dwell_s = 0)", "dwell_s is 0, it must be greater than 0"),
        ("press(1.0, 1.0, [0.1], speed_mm_per_s = -1)", "speed_mm_per_s is -1, it must be greater than 0"),
        ("press(1.0, 1.0, [0.1], approach_from_mm = [1])", "approach_from_mm must be [dx, dy]"),
        ("press(float('nan'), 1.0, [0.1])", "x_mm is NaN, not a finite number"),
        ("move(1.0, float('inf'))", "y_mm is inf, not a finite number"),
        ("wait(-1)", "duration_s is -1, it must be greater than 0"),
        ("covering(0)", "thickness_mm is 0, it must be greater than 0"),
        ("sqrt(-1)", "sqrt(-1) is not a finite number"),
        ("uniform(2, 1)", "low is 2, greater than high, which is 1"),
        ("range(1, 2, 0)", "the step of a range is 0"),
        ("param('x', default = 1)", "parameters are declared at the top level, not inside run"),
        ("fail('found', 3, [1.5])", "found 3 [1.5]"),
    ] {
        assert_eq!(problem_in(body), format!("bad.star:2:5: {wanted}"), "{body}");
    }
    for (body, wanted) in [
        ("press(x_mm = 1.0, depths_mm = [0.2])", "y_mm"),
        ("press('a', 1.0, [0.2])", "x_mm"),
        ("press(1.0, 1.0, [0.2], depth = 3)", "depth"),
        ("nothing()", "nothing"),
        ("x = 1 + 'a'", "Operation `+` not supported"),
        ("x = [1][5]", "Index"),
    ] {
        let problem = problem_in(body);
        assert!(problem.starts_with("bad.star:2:") && problem.contains(wanted), "{body}: {problem}");
    }
}

#[test]
fn the_top_level_declares_and_does_nothing() {
    assert_eq!(
        problem("tare()\ndef run(rig):\n    pass\n"),
        "bad.star:1:1: only run(rig) may do something: the top level declares parameters"
    );
    assert_eq!(
        problem("A = param('a', default = 1)\nB = param('a', default = 1)\ndef run(rig):\n    pass\n"),
        "bad.star:2:5: the parameter \"a\" is declared twice"
    );
    assert_eq!(
        problem("A = param('a', default = [])\ndef run(rig):\n    pass\n"),
        "bad.star:1:5: a parameter's default list needs at least one value"
    );
    assert!(problem("def run(rig):\n    pass\nrun = 3\n").starts_with("bad.star:1:"));
    assert!(
        problem("def run():\n    pass\n").starts_with("bad.star:1:"),
        "{}",
        problem("def run():\n    pass\n")
    );
}

#[test]
fn a_script_decides_from_what_it_read() {
    let source = "
def run(rig):
    at = move(3.0, 4.0, height_mm = 1.5)
    reading = read()
    noise = dwell(0.5)
    first = press(rig.elements[19].x_mm, rig.elements[19].y_mm, [0.2, 0.4], approach_from_mm = (1, 0))
    if first[1].signal[19] > 1.5 * first[0].signal[19]:
        wait(2)
    log('element', rig.elements[19].row, 'at', at.height_mm, [reading.frames, noise.frames])
    return {'counts': len(reading.counts), 'rate': rig.rate_hz, 'list': [1, 2.5, None, True], 'of': reading.frames}
";
    let (outcome, rig) = run(source).unwrap();
    assert_eq!(outcome.result.to_string(), r#"{"counts":48,"list":[1,2.5,null,true],"of":8,"rate":30.0}"#);
    assert_eq!(rig.logged(), "element 2 at 1.5 [8, 15]\n");
    assert!(matches!(rig.calls[4].step, Step::Wait { duration_s: 2.0 }), "{:?}", rig.calls[4]);
}

#[test]
fn guarded_operators_are_the_languages_own() {
    let source = "
def run(rig):
    x = 3
    x += 4
    l = [1] + [2] * 2
    l += [5]
    return [
        x, l, 7 % 4, 2.5 * 2, 1 + 2.5, 'a' + 'b', 'ab' * 2, '%s: %d' % ('n', 3), (1,) + (2,), {'a': 1} | {'b': 2},
        list(zip([1, 2, 3], ('a', 'b'))), list(range(5, 0, -2)), str([1.0, 'x', (1, {})]), sum([1, 2.5]),
        round(2.34567, 2), len(shuffled(range(9))), 6 | 1, -7 % 3, abs(-2), atan2(0, 1),
    ]
";
    let (outcome, _) = run(source).unwrap();
    assert_eq!(
        outcome.result.to_string(),
        r#"[7,[1,2,2,5],3,5.0,3.5,"ab","abab","n: 3",[1,2],{"a":1,"b":2},[[1,"a"],[2,"b"]],[5,3,1],"[1.0, \"x\", (1, {})]",3.5,2.35,9,7,2,2,0.0]"#
    );
}
