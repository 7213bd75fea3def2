use super::super::outcome::tests::set;
use super::*;

fn of(campaign: Campaign, id: &str, outcome: Outcome) -> Outcome {
    Outcome { campaign, id: id.into(), ..outcome }
}

fn at(z: f64, mut outcome: Outcome) -> Outcome {
    outcome.truths.iter_mut().for_each(|truth| truth.z = z);
    outcome
}

#[test]
fn any_verdict_but_nothing_missing_is_a_false_alarm() {
    let sets = [
        of(Campaign::FalseAlarms, "false-alarms/white-000", set(&[], &[], "nothing-missing")),
        of(Campaign::FalseAlarms, "false-alarms/white-001", set(&[], &[], "unexplained")),
        of(Campaign::FalseAlarms, "false-alarms/coloured-000", set(&[], &[("imprint", &[])], "explained")),
        of(Campaign::FalseAlarms, "false-alarms/quantised-000", set(&[], &[], "failed")),
    ];
    let scores = Scores::new(&sets);
    let hits = |noise: &str| (scores.false_alarms[noise].hits, scores.false_alarms[noise].of);
    assert_eq!((hits("all"), hits("white"), hits("coloured")), ((3, 4), (1, 2), (1, 1)));
    assert_eq!(scores.failed, ["false-alarms/quantised-000"]);
}

#[test]
fn names_count_among_all_sets_also_where_nothing_was_detected() {
    let effect = [Some("backlash")];
    let sets = [
        set(&effect, &[("backlash", &[])], "explained"),
        set(&effect, &[("hysteresis", &["backlash"])], "explained"),
        set(&effect, &[("imprint", &[])], "explained"),
        set(&effect, &[], "nothing-missing"),
        at(5.0, set(&effect, &[], "unexplained")),
    ];
    let scores = Scores::new(&sets);
    let Some(band) = scores.bands.iter().find(|band| band.name == "16 and more") else { panic!("a band") };
    assert_eq!((band.detected.hits, band.detected.of), (3, 4));
    assert_eq!((band.exact.hits, band.exact.of), (1, 4));
    assert_eq!((band.in_set.hits, band.in_set.of), (2, 4));
    assert_eq!((band.wrong.hits, band.wrong.of), (1, 4));
    assert_eq!((band.set_size.of, band.set_size.mean, band.set_size.greatest), (3, 4.0 / 3.0, 2));
    assert_eq!(scores.bands[0].detected.of, 5);
    let cell = |named: &str| scores.confusion.iter().find(|cell| cell.named == named).map(|cell| cell.count);
    assert_eq!((cell("backlash"), cell("nothing"), cell("unexplained")), (Some(1), Some(1), None));
}

#[test]
fn a_shrink_counts_only_where_the_gap_is_known() {
    let known = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let unknown = Outcome { shrink: Some(-3.0), shrink_error: 0.4, ..known.clone() };
    let mut own = Outcome { alone_shrink: Some(0.9), named: Vec::new(), ..known.clone() };
    own.truths[0].own_shrink = Some(0.6);
    let band = &Scores::new(&[known, unknown, own]).bands[0];
    assert_eq!((band.shrink.of, band.shrink.median), (2, Some(0.9)));
    assert_eq!(band.shrink_to_own_fit.of, 1);
    assert!(band.shrink_to_own_fit.median.is_some_and(|median| (median - 1.5).abs() < 1e-12));
}

#[test]
fn of_several_effects_each_is_recalled_and_each_name_is_right_or_not() {
    let truths = [Some("backlash"), Some("imprint")];
    let sets = [
        of(Campaign::Pairs, "pairs/000", set(&truths, &[("backlash", &[]), ("imprint", &[])], "explained")),
        of(Campaign::Pairs, "pairs/001", set(&truths, &[("backlash", &[]), ("hardening", &[])], "explained")),
        of(Campaign::Pairs, "pairs/002", set(&truths, &[], "unexplained")),
    ];
    let pairs = Scores::new(&sets).pairs;
    assert_eq!((pairs.recall.hits, pairs.recall.of), (3, 6));
    assert_eq!((pairs.precision.hits, pairs.precision.of), (3, 4));
}

#[test]
fn costs_are_told_over_all_sets() {
    let costs = [1.0, 2.0, 3.0, 4.0, 500.0];
    let sets = costs.map(|seconds| Outcome { seconds, peak_mib: 10.0 * seconds, ..set(&[], &[], "failed") });
    let scores = Scores::new(&sets);
    let (Some(seconds), Some(peak_mib)) = (scores.seconds, scores.peak_mib) else { panic!("five sets") };
    assert_eq!((seconds.median, seconds.greatest, peak_mib.greatest), (3.0, 500.0, 5000.0));
}

#[test]
fn power_is_grouped_by_powers_of_two_of_the_separation() {
    let sets = [2.0, 2.01, 8.0].map(|z| at(z, set(&[Some("backlash")], &[], "nothing-missing")));
    let power = &Scores::new(&sets).power["backlash"];
    assert_eq!(power.iter().map(|point| point.detected.of).collect::<Vec<_>>(), [2, 1]);
    assert!((power[1].z - 8.0).abs() < 1e-9);
}

/// It detects with the probability of its level at a z of 0, and with 1/2 at its quantile.
#[test]
fn the_oracle_is_the_normal_test_at_its_level() {
    assert!((oracle(0.0) - ORACLE_LEVEL).abs() < 1e-4);
    assert!((oracle(ORACLE_QUANTILE) - 0.5).abs() < 1e-12);
    assert!(oracle(Z_DETECTABLE) > 0.98);
}

#[test]
fn outside_the_library_the_verdict_counts() {
    let outside = |verdict: &str, names: &[(&str, &[&str])]| {
        of(Campaign::Outside, "outside/x", set(&[None], names, verdict))
    };
    let sets = [
        outside("unexplained", &[]),
        outside("partly-explained", &[("backlash", &[])]),
        outside("nothing-missing", &[]),
        outside("unexplained", &[]),
    ];
    let scores = Scores::new(&sets);
    let all = &scores.outside["all"];
    assert_eq!((all.unexplained.hits, all.wrong.hits, all.partly.hits, all.missed.hits), (2, 1, 1, 1));
    assert_eq!(scores.outside["made-up"].unexplained.of, 4);
}

#[test]
fn library_points_and_sets_that_nobody_could_name_are_counted_apart() {
    let right = set(&[Some("backlash")], &[("backlash", &[])], "explained");
    let [mut point, mut twin, mut unknown] = [right.clone(), right.clone(), right.clone()];
    point.truths[0].is_library_point = true;
    twin.truths[0].z_name = Some(4.0);
    unknown.truths[0].z_name = None;
    let scores = Scores::new(&[right, point, twin, unknown]);
    assert_eq!((scores.bands[0].exact.of, scores.library_points[0].exact.of), (3, 1));
    assert_eq!(scores.nameable.exact.of, 1);
}

#[test]
fn pairs_that_nobody_could_name_are_counted_apart() {
    let truths = [Some("backlash"), Some("imprint")];
    let named =
        of(Campaign::Pairs, "pairs/000", set(&truths, &[("backlash", &[]), ("imprint", &[])], "explained"));
    let mut twin = of(Campaign::Pairs, "pairs/001", set(&truths, &[("backlash", &[])], "explained"));
    twin.truths[1].z_name = Some(4.0);
    let scores = Scores::new(&[named, twin]);
    assert_eq!((scores.pairs.named.hits, scores.pairs.named.of), (1, 2));
    assert_eq!((scores.nameable_pairs.named.hits, scores.nameable_pairs.named.of), (1, 1));
    assert_eq!(scores.nameable_triples.named.of, 0);
}
