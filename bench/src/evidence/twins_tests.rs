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
    let undecided = |of: &[(&str, &[&str])]| {
        let one = |(effect, equivalent): &(&str, &[&str])| Undecided {
            effect: (*effect).into(),
            equivalent: equivalent.iter().map(|name| (*name).into()).collect(),
        };
        of.iter().map(one).collect()
    };
    let chosen = Chosen {
        experiment: "diagnose".into(),
        parameters: [("parts".into(), "approach".into())].into(),
        duration_s: 60.4,
        before: undecided(before),
        after: undecided(after),
    };
    Decision { twins: LOST_MOTION, chosen: vec![chosen] }
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
    let none = Decision { twins: LOST_MOTION, chosen: Vec::new() };
    assert!(twins_table(&[none]).ends_with("| nothing undecided |  | 0 s | - | **no** |\n"));
}

#[test]
fn the_rig_hides_nothing_of_its_own() {
    let rig = plain(RIG).unwrap_or_default();
    assert!(rig.contains("quadratic_per_mm = 0.0") && !rig.contains("miswired"), "{rig}");
}
