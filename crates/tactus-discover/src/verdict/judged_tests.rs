use super::*;

/// Effects were named, a test rejects the base model, and none the grown one.
const NAMED: Evidence = Evidence {
    is_named: true,
    is_missing: true,
    is_left: false,
    closed_most: 1.0,
    upper_noise: 1.9,
    tolerance_noise: 0.0,
};

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

#[test]
fn names_that_take_the_model_further_away_explain_nothing_however_little_is_left() {
    let further = Evidence { closed_most: -0.1, ..NAMED };
    assert_eq!(further.verdict(), Verdict::PartlyExplained);
    assert_eq!(
        Evidence { upper_noise: 0.1, tolerance_noise: 1.0, ..further }.verdict(),
        Verdict::PartlyExplained
    );
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
