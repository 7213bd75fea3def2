use super::*;

const LOST_MOTION: Twins = Twins {
    physics: "lost-motion",
    strength: 0.2,
    effect: "backlash",
    twins: &["hysteresis"],
    experiment: "corners",
};

/// A round with one experiment.
fn decision(before: &[(&str, &[&str])], after: &[(&str, &[&str])]) -> Decision {
    let chosen = Chosen {
        experiment: "diagnose".into(),
        parameters: [("parts".into(), "approach".into())].into(),
        duration_s: 60.4,
        before: named(before),
        after: named(after),
    };
    Decision { twins: LOST_MOTION, named: named(after), chosen: vec![chosen] }
}

fn named(effects: &[(&str, &[&str])]) -> Vec<Undecided> {
    let one = |(effect, equivalent): &(&str, &[&str])| Undecided {
        effect: (*effect).into(),
        equivalent: equivalent.iter().map(|name| (*name).into()).collect(),
    };
    effects.iter().map(one).collect()
}

#[test]
fn a_pair_is_decided_by_the_right_name_alone() {
    let undecided: &[(&str, &[&str])] = &[("hysteresis", &["backlash"])];
    let right = decision(undecided, &[("backlash", &["time-lag"])]);
    assert!(right.is_undecided_before() && right.is_decided_after());
    for after in [undecided, &[("hysteresis", &[])], &[("backlash", &["hysteresis"])], &[]] {
        assert!(!decision(undecided, after).is_decided_after(), "{after:?}");
    }
    assert!(!decision(&[("backlash", &[])], &[("backlash", &[])]).is_undecided_before());
}

#[test]
fn the_table_says_what_was_run_and_whether_it_decided() {
    let right = decision(&[("hysteresis", &["backlash"])], &[("backlash", &[])]);
    let line = "| lost-motion | 0.2 | backlash or hysteresis | corners | hysteresis or backlash | \
                diagnose parts=approach | 60 s | backlash | yes |";
    assert_eq!(twins_table(&[right]).lines().nth(2), Some(line));
    let without_a_round = |effects: &[(&str, &[&str])]| {
        twins_table(&[Decision { twins: LOST_MOTION, named: named(effects), chosen: Vec::new() }])
    };
    let decided = without_a_round(&[("backlash", &["time-lag"])]);
    assert!(
        decided.ends_with("| backlash or time-lag |  | 0 s | - | by the first experiment |\n"),
        "{decided}"
    );
    let wrong = without_a_round(&[("hysteresis", &[])]);
    assert!(wrong.ends_with("| hysteresis |  | 0 s | - | **no** |\n"), "{wrong}");
    assert!(without_a_round(&[]).ends_with("| nothing named |  | 0 s | - | **no** |\n"));
}

#[test]
fn the_rig_hides_nothing_of_its_own() {
    let rig = plain(RIG).unwrap_or_default();
    assert!(rig.contains("quadratic_per_mm = 0.0") && !rig.contains("miswired"), "{rig}");
}
