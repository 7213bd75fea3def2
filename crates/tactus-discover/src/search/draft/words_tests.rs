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
        "While the tool touches, the signal changes by a share that follows the sum of signals, levelling off with a length of 1.000 mm: \
         -19.6 to 0 %"
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
