use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tactus_schema::table::{Phase, RowView};

use super::*;
use crate::fixtures::{ELEMENTS, ShippedRig, found, known, measured, processes};
use crate::{Floor, Frames, discover};

/// Effects were named, a test rejects the base model, and none the grown one.
const NAMED: Evidence =
    Evidence { is_named: true, is_missing: true, is_left: false, upper_noise: 1.9, tolerance_noise: 0.0 };

#[test]
fn names_explain_if_no_test_rejects_and_less_than_twice_the_noise_is_left() {
    assert_eq!(NAMED.verdict(), Verdict::Explained);
    assert_eq!(Evidence { is_left: true, ..NAMED }.verdict(), Verdict::PartlyExplained);
    assert_eq!(Evidence { upper_noise: 2.1, ..NAMED }.verdict(), Verdict::PartlyExplained);
    assert_eq!(Evidence { is_left: true, upper_noise: 0.4, ..NAMED }.verdict(), Verdict::Explained);
    let tolerable = Evidence { is_left: true, upper_noise: 30.0, tolerance_noise: 31.0, ..NAMED };
    assert_eq!(tolerable.verdict(), Verdict::Explained);
    assert_eq!(Evidence { tolerance_noise: 29.0, ..tolerable }.verdict(), Verdict::PartlyExplained);
}

/// Nine tenths of the variance of a gap of ten times the noise leave three times the noise: 32 % of the rms.
#[test]
fn no_share_of_the_gap_explains() {
    let upper_noise = 10.0 * (1.0_f64 - 0.9).sqrt();
    assert_eq!(Evidence { upper_noise, ..NAMED }.verdict(), Verdict::PartlyExplained);
}

#[test]
fn without_names_nothing_is_missing_only_if_more_than_twice_the_noise_would_show() {
    let unnamed = Evidence { is_named: false, is_missing: false, ..NAMED };
    assert_eq!(unnamed.verdict(), Verdict::NothingMissing);
    assert_eq!(Evidence { upper_noise: 2.1, ..unnamed }.verdict(), Verdict::CannotJudge);
    assert_eq!(Evidence { upper_noise: f64::INFINITY, ..unnamed }.verdict(), Verdict::CannotJudge);
    assert_eq!(Evidence { is_missing: true, ..unnamed }.verdict(), Verdict::Unexplained);
}

/// The deepest frame of each press, as in a table of averaged presses. Each element is pressed this many times.
fn one_frame_a_press(repeats: usize, noise_counts: f64) -> Frames {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let whole = measured(&known, &[], &processes(ELEMENTS, 0.0, 1e-3, &mut rng));
    let noise = processes(ELEMENTS, noise_counts, 1e-3, &mut rng);
    let mut frames = Frames::new(ELEMENTS);
    for (press, noise) in (0..ELEMENTS * repeats).zip(noise) {
        let frame = 30 * (press % ELEMENTS) + 19;
        #[expect(clippy::cast_possible_truncation, reason = "counts are stored so")]
        let counts: Vec<f32> =
            whole.counts_of(frame).iter().zip(noise).map(|(counts, noise)| counts + noise as f32).collect();
        frames.push(RowView {
            run: "a",
            press: i32::try_from(press).unwrap(),
            phase: Phase::Hold,
            t_ns: i64::try_from(press).unwrap() * 5_000_000_000,
            position_mm: whole.position_mm[frame],
            covering_mm: 1.016,
            indenter: "cyl1",
            temperature_c: None,
            counts: &counts,
        });
    }
    frames
}

fn judged(frames: &Frames) -> Discovery {
    let options = Options { seed: 1, threads: 2, rule: Rule::Protocol, tolerance_counts: Some(5.0) };
    discover(&known(), frames, options, &ShippedRig::new(1.0), &|_| {}).unwrap()
}

#[test]
fn without_repeats_nothing_is_judged_and_what_to_run_is_said() {
    let found = judged(&one_frame_a_press(1, 54.0));
    assert_eq!((found.verdict, found.floor), (Verdict::CannotJudge, Floor::None));
    assert!(found.steps.is_empty() && found.rounds.is_empty() && found.gap.is_empty());
    assert_eq!((found.global, found.base.heldout_chi2, found.base.structured), (None, None, None));
    assert!(found.base.heldout_rms_counts > 30.0);
    let [next] = &found.plan.next[..] else { panic!("{:?}", found.plan) };
    assert_eq!((&*next.experiment, &*next.parameters[0].1), ("diagnose", "drift,repeats"));
    assert!(next.duration_s > 200.0, "{}", next.duration_s);
}

#[test]
fn repeats_of_places_are_a_floor_of_one_frame_a_press() {
    let found = judged(&one_frame_a_press(6, 2.0));
    assert!(matches!(found.floor, Floor::Repeats { .. }), "{:?}", found.floor);
    assert_eq!((found.verdict, found.steps.len()), (Verdict::NothingMissing, 0), "{:?}", found.gap);
    let structured = found.base.structured.unwrap();
    assert!(structured.upper_noise < SEEN_NOISE, "{structured:?}");
    assert_eq!(found.tolerance_counts, Some(5.0));
}

/// Two runs of one rig: in the second all elements are 2 % more sensitive, and their zeros lie elsewhere.
#[test]
fn runs_of_one_rig_may_differ_in_gain_and_zeros() {
    let known = known();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut run = || measured(&known, &[], &processes(ELEMENTS, 1.0, 1e-3, &mut rng));
    let (first, second) = (run(), run());
    let mut both = Frames::new(ELEMENTS);
    first.rows().for_each(|row| both.push(row));
    for row in second.rows() {
        let counts: Vec<f32> = row.counts.iter().map(|counts| 130.0 + 1.02 * (counts - 100.0)).collect();
        both.push(RowView { run: "b", counts: &counts, ..row });
    }
    let found = found(&known, &both);
    assert_eq!(found.verdict, Verdict::NothingMissing, "{:?}", found.gap);
    let [one, other] = found.grown.run_gains[..] else { panic!("two runs: {:?}", found.grown.run_gains) };
    assert!((other / one - 1.02).abs() < 1e-3, "{other} / {one}");
    assert!((one * other - 1.0).abs() < 1e-9, "the mean is 1: {one} {other}");
}

/// Two blocks cannot give less than a quarter, and do so if both gain.
#[test]
fn few_blocks_confirm_what_all_of_them_show() {
    let step = |folds_p_value: f64, blocks: f64| Step {
        added: AddedEffect { folds_p_value, ..coarse(1.0, 1.0, 1.0) },
        least_p: 0.5_f64.powf(blocks),
    };
    assert!(step(0.26, 2.0).is_confirmed() && !step(0.5, 2.0).is_confirmed());
    assert!(step(0.52, 1.0).is_confirmed() && !step(1.0, 1.0).is_confirmed());
    assert!(step(0.04, 20.0).is_confirmed() && !step(0.06, 20.0).is_confirmed());
}
