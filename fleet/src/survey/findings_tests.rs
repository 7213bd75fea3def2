use super::*;

fn result(rig: &str, run: &str, verdict: &str, effects: &[&str]) -> RunResult<Discovered> {
    let found = Discovered {
        verdict: verdict.to_owned(),
        effects: effects.iter().map(|effect| (*effect).to_owned()).collect(),
    };
    RunResult::new(run, rig, Outcome::Found(found))
}

#[test]
fn an_effect_is_shared_if_half_of_the_judged_runs_of_two_rigs_show_it() {
    let discovered = [
        result("left", "1", "explained", &["relaxation", "relaxation", "tilt"]),
        result("left", "2", "nothing-missing", &[]),
        result("left", "3", CANNOT_JUDGE, &[]),
        result("right", "4", "partly-explained", &["relaxation"]),
        result("far", "5", "nothing-missing", &[]),
        RunResult::new("6", "far", Outcome::Refused("too few presses".to_owned())),
    ];
    let report = findings("here", &[], &discovered);
    assert_eq!((report.runs, report.rigs), (6, 3));
    assert_eq!(report.refused, ["6 of rig far: too few presses"]);
    let at = |rig: &str, shown, judged| AtRig { rig: rig.to_owned(), shown, judged };
    let [relaxation, tilt] = report.effects.as_slice() else { panic!("{:?}", report.effects) };
    assert_eq!((relaxation.effect.as_str(), relaxation.shared), ("relaxation", true));
    assert_eq!(relaxation.rigs, [at("left", 1, 2), at("right", 1, 1)]);
    assert_eq!((tilt.effect.as_str(), tilt.shared), ("tilt", false));
}
