use super::*;
use crate::verdict::conclude::misread;

/// Two blocks cannot give less than a quarter, and do so if both gain.
#[test]
fn few_blocks_confirm_what_all_of_them_show() {
    let step = |folds_p_value: f64, blocks: f64| Step {
        added: AddedEffect { folds_p_value: Some(folds_p_value), ..misread(&[], 1.0, 1.0) },
        least_p: 0.5_f64.powf(blocks),
    };
    assert!(step(0.26, 2.0).is_confirmed() && !step(0.5, 2.0).is_confirmed());
    assert!(step(0.52, 1.0).is_confirmed() && !step(1.0, 1.0).is_confirmed());
    assert!(step(0.04, 20.0).is_confirmed() && !step(0.06, 20.0).is_confirmed());
}

#[test]
fn beside_a_random_walk_the_odds_alone_confirm() {
    let added = AddedEffect { folds_p_value: None, ..misread(&[], 1.0, 1.0) };
    assert!(Step { added, least_p: 0.5 }.is_confirmed());
}
