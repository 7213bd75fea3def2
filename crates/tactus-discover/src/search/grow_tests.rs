use super::super::score::sign_flip_p;
use super::{FLIPS, is_missing};

/// A loose contact that five presses show, each by ten standard deviations: flips of five signs agree by chance in one of 16 cases.
#[test]
fn what_few_presses_show_beyond_doubt_is_missing() {
    let p_value = sign_flip_p(&[10.0; 5], FLIPS, 1);
    assert!(p_value > 0.02, "{p_value}");
    let ln_odds = 5.0 * 10.0_f64.powi(2) / 2.0 - 20.0_f64.ln();
    assert!(is_missing(p_value, ln_odds));
    assert!(!is_missing(p_value, 20.0), "as likely as noise of a larger variance");
    assert!(
        is_missing(0.0005, 3.0) && !is_missing(0.004, 3.0),
        "where the test of all rejects, odds may be small"
    );
}
