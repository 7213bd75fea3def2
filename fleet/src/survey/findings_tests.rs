use super::*;
use crate::survey::calibrated::CoveringSpread;

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

/// A spread of 2.7 mm under the covering of 1.016 mm, which widens by so much a day; that under another covering does not.
fn aged(rig: &str, day: i64, per_day_mm: f64) -> RunResult<Calibrated> {
    // Scatter that no line follows.
    let scatter_mm = [0.001, -0.002, 0.002, -0.001, 0.0, -0.001][usize::try_from(day).unwrap()];
    let spread = |covering_mm, sigma_mm| CoveringSpread { covering_mm, sigma_mm: [sigma_mm, 0.002] };
    let found = Calibrated {
        sensitivity_counts_per_mm: Some([1000.0, 2.0]),
        baseline_counts: Some([100.0, 0.1]),
        noise_rms_counts: Some(2.0),
        spreads: vec![
            spread(1.016, 2.725 + per_day_mm * day as f64 + scatter_mm),
            spread(2.54, 3.482 - scatter_mm),
        ],
        faulty: Vec::new(),
        missing: Vec::new(),
    };
    let result = RunResult::new(&format!("{rig}-{day}"), rig, Outcome::Found(found));
    RunResult { started_ns: Some(day * 86_400_000_000_000), ..result }
}

#[test]
fn a_covering_whose_spread_widens_from_day_to_day_ages_and_no_other_does() {
    let runs: Vec<_> = (0..6).flat_map(|day| [aged("left", day, 0.01), aged("right", day, 0.0)]).collect();
    let report = findings("here", &runs, &[]);
    let changing = |trends: &[Trend]| -> Vec<(String, Option<f64>)> {
        let changing = trends.iter().filter(|trend| trend.changes);
        changing.map(|trend| (trend.rig.clone(), trend.covering_mm)).collect()
    };
    assert_eq!(changing(&report.drifts), []);
    assert_eq!(changing(&report.ageing), [("left".to_owned(), Some(1.016))]);
    let slope = report.ageing[0].slope.unwrap();
    assert!((slope.per_day - 0.01).abs() < 0.001, "{slope:?}");
}
