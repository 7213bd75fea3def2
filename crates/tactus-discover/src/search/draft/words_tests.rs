use tactus_model::Covariate;
use tactus_model::effect::{Carrier, Draft, Law, When};

use super::sentence;

#[test]
fn a_draft_is_told_in_one_sentence() {
    let draft = Draft {
        name: "draft-1".into(),
        sentence: String::new(),
        carrier: Carrier::OwnSignal,
        when: When::InContact,
        covariates: vec![Covariate::SumOfSignals],
        ranges: vec![[0.0, 4.0]],
        law: Law::Saturating { scale: -0.2, length: 1.0 },
        weights: None,
    };
    assert_eq!(
        sentence(&draft),
        "While the tool touches, the signal changes by a share that follows the sum of signals, levelling off with a length of 1.000 mm \
         (times the sensitivity): -19.6 to 0 %"
    );
    let grounded = Draft {
        carrier: Carrier::Counts,
        covariates: vec![Covariate::Depth],
        ranges: vec![[0.0, 0.6]],
        law: Law::Linear { offset: 5.0, slope: 0.0 },
        weights: Some(vec![1.0; 48]),
        ..draft
    };
    assert_eq!(
        sentence(&grounded),
        "While the tool touches, counts are added, a number, with a weight for each element, that is constant: 5.00 counts"
    );
}

#[test]
fn small_numbers_are_told_too() {
    let by_counts = |law| Draft {
        name: "draft-1".into(),
        sentence: String::new(),
        carrier: Carrier::Counts,
        when: When::Always,
        covariates: vec![Covariate::Counts],
        ranges: vec![[0.0, 4e-4]],
        law,
        weights: None,
    };
    let jump = sentence(&by_counts(Law::Threshold { scale: 6e-6, at: 2.5e-4 }));
    assert!(jump.contains("at once from 0.00025 counts on"), "{jump}");
    let tone = Law::Periodic { offset: 0.0, sine: 1e-6, cosine: 0.0, per_unit: 8e4 };
    let tone = sentence(&by_counts(tone));
    assert!(tone.contains("with a period of 0.000013 counts"), "{tone}");
}

#[test]
fn both_ends_of_a_range_have_the_same_decimals_and_a_hair_beside_zero_is_zero() {
    let power = |scale: f64| Draft {
        name: "draft-1".into(),
        sentence: String::new(),
        carrier: Carrier::OwnSignal,
        when: When::InContact,
        covariates: vec![Covariate::Depth],
        ranges: vec![[0.001, 7.0]],
        law: Law::Power { scale, exponent: 2.0 },
        weights: None,
    };
    for (scale, told) in [(-0.00365, ": -17.9 to 0 %"), (0.022_9, ": 0 to 112 %")] {
        let said = sentence(&power(scale));
        assert!(said.ends_with(told), "{said}");
    }
    let linear =
        Draft { law: Law::Linear { offset: 0.085, slope: 0.01 }, ranges: vec![[0.0, 7.5]], ..power(1.0) };
    assert!(sentence(&linear).ends_with(": 8.5 to 16.0 %"), "{}", sentence(&linear));
}

#[test]
fn the_range_is_that_of_the_element_with_the_least_and_the_greatest_weight() {
    let mut draft = Draft {
        name: "draft-1".into(),
        sentence: String::new(),
        carrier: Carrier::Counts,
        when: When::InContact,
        covariates: vec![Covariate::Depth],
        ranges: vec![[0.0, 0.5]],
        law: Law::Linear { offset: 1.0, slope: 4.0 },
        weights: Some(vec![0.5, 2.0, 1.0]),
    };
    let ends_with = |draft: &Draft, told: &str| {
        let said = sentence(draft);
        assert!(said.ends_with(told), "{told}: {said}");
    };
    ends_with(&draft, ": 0.50 to 6.00 counts");
    draft.weights = Some(vec![-1.0, 2.0]);
    ends_with(&draft, ": -3.00 to 6.00 counts");
    draft.law = Law::Linear { offset: 3.0, slope: 0.0 };
    ends_with(&draft, "that is constant: -3.00 to 6.00 counts");
    draft.weights = Some(vec![2.0, 2.0]);
    ends_with(&draft, "that is constant: 6.00 counts");
    draft.law = Law::Table { at: vec![vec![0.0, 0.1, 0.5]], values: vec![0.0, -1.0, 0.5] };
    ends_with(&draft, ": -2.00 to 1.00 counts");
}

/// A tone of 50 Hz over a minute: equal steps through the range may all meet it at one phase.
#[test]
fn a_tone_has_its_whole_amplitude() {
    let draft = Draft {
        name: "draft-1".into(),
        sentence: String::new(),
        carrier: Carrier::Counts,
        when: When::Always,
        covariates: vec![Covariate::Time],
        ranges: vec![[0.0, 60.0]],
        law: Law::Periodic { offset: 1.0, sine: 3.0, cosine: 4.0, per_unit: 50.0 },
        weights: None,
    };
    let said = sentence(&draft);
    assert!(said.ends_with(": -4.00 to 6.00 counts"), "{said}");
    let said = sentence(&Draft { weights: Some(vec![0.5, 1.5]), ..draft });
    assert!(said.ends_with(": -6.00 to 9.00 counts"), "{said}");
}
