use tactus_model::effect::{Carrier, Draft, Law, When};
use tactus_model::{Covariate, Effect};

use super::*;
use crate::commands::discover::model::tests::{before, found};

#[test]
fn a_line_names_curves_and_tables_beside_the_parameters() {
    let curve = |at, of| FittedCurve { at, of, knots: Vec::new(), formula: None };
    let table = curve("x_mm", "offset_y_mm");
    assert_eq!(with_curves(String::new(), &[table]), "offset_y_mm as a table of x_mm");
    let knots = curve("at_mm", "growth");
    assert_eq!(with_curves("own_share 0.2".into(), &[knots]), "own_share 0.2, growth through knots");
    assert_eq!(with_curves("ratio 1.1".into(), &[]), "ratio 1.1");
}

#[test]
fn a_number_without_an_error_is_short() {
    let cases = [
        (22.0, "22"),
        (0.999_999_998_268, "1.0000"),
        (0.012_345_6, "0.01235"),
        (1234.56, "1235"),
        (-0.5, "-0.5000"),
    ];
    for (value, words) in cases {
        assert_eq!(four_digits(value), words);
    }
}

#[test]
fn under_the_added_effects_stand_a_drafts_sentence_and_parameters_not_to_be_trusted() {
    let mut discovery = found(&before());
    assert_eq!(about(&discovery, &discovery.steps[0]), Vec::<String>::new());
    discovery.steps[0].terms[0][3].standard_error = Some(0.95);
    assert_eq!(
        about(&discovery, &discovery.steps[0]),
        [
            "miswired: other_share has a standard error greater than its value: these data hardly determine it."
        ]
    );
    let draft = Draft {
        name: "draft-1".into(),
        sentence: "While the tool touches, counts are added".into(),
        carrier: Carrier::Counts,
        when: When::InContact,
        covariates: vec![Covariate::Depth],
        ranges: vec![[0.0, 0.6]],
        law: Law::Linear { offset: 5.0, slope: 1.0 },
        weights: None,
    };
    let definition = draft.define().unwrap();
    discovery.effects.push(Effect::neutral(definition));
    let step = AddedEffect { effect: definition.name, terms: Vec::new(), ..discovery.steps[0].clone() };
    assert_eq!(about(&discovery, &step), ["draft-1: While the tool touches, counts are added."]);
}
