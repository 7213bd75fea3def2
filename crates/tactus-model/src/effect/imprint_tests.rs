use crate::Effect;
use crate::effect::bench::{effect, free, signals_mm};

fn dented(recovery_s: f64) -> Effect {
    dented_for(recovery_s, 1.0)
}

fn dented_for(recovery_s: f64, spread_ratio: f64) -> Effect {
    effect("imprint", [("set_share", 0.1), ("recovery_s", recovery_s), ("spread_ratio", spread_ratio)])
}

fn assert_near<const N: usize>(got: [f64; N], want: [f64; N]) {
    let near = got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-12);
    assert!(near, "{got:?} {want:?}");
}

#[test]
fn a_dent_recovers_exponentially_and_adds_to_what_presses_less() {
    let got = signals_mm(
        &dented(20.0),
        [(0.0, 0.5), (3.0, 0.5), (3.0, -1.0), (13.0, -1.0), (13.0, 0.01), (13.0, 0.2), (33.0, 0.0)],
    );
    let left = |mm: f64, t_s: f64| 0.1 * mm * (-t_s / 20.0_f64).exp();
    // The second press is shallow: the first one's dent is the deeper for as long as it is.
    let last = left(0.5, 30.0).max(0.1 * (0.2 / 20.0 * 20.0) * (-20.0 / 20.0_f64).exp());
    // 0.01 and 0.2 mm press less deep than what is left of 0.5 mm after 10 s, which is 0.303 mm.
    let shallow = |mm: f64| mm + left(0.5, 10.0) - 0.1 * mm;
    assert_near(got, [0.5, 0.5, 0.05, left(0.5, 10.0), shallow(0.01), shallow(0.2), last]);
}

#[test]
fn a_slow_release_leaves_the_same_in_any_number_of_steps() {
    // Down at 0.05 mm/s with a recovery of 3 s: below 0.15 mm the signal falls faster than the dent recovers.
    let fine: [_; 101] = std::array::from_fn(|k| (k as f64 / 10.0, 0.5 - 0.05 * (k as f64 / 10.0)));
    let [.., coarse] = signals_mm(&dented(3.0), [fine[0], fine[100]]);
    let [.., fine] = signals_mm(&dented(3.0), fine);
    assert_near([coarse, fine], [0.015 * (-1.0_f64).exp(); 2]);
}

#[test]
fn three_dents_recover_in_equal_shares() {
    let got = signals_mm(&dented_for(20.0, 4.0), [(0.0, 0.6), (0.0, -1.0), (7.0, -1.0), (90.0, -1.0)]);
    let left = |t_s: f64| 0.02 * [5.0, 20.0, 80.0].map(|tau_s: f64| (-t_s / tau_s).exp()).iter().sum::<f64>();
    assert_near(got, [0.6, left(0.0), left(7.0), left(90.0)]);
}

#[test]
fn knots_are_the_weights_of_recoveries() {
    let [taus_s, weights] = [[2.0, 15.0, 300.0], [0.04, 0.0, 0.1]];
    let got = signals_mm(
        &free("imprint", [], &taus_s, &weights),
        [(0.0, 0.6), (0.0, -1.0), (7.0, -1.0), (90.0, -1.0)],
    );
    let left =
        |t_s: f64| 0.6 * taus_s.iter().zip(weights).map(|(tau, w)| w * (-t_s / tau).exp()).sum::<f64>();
    assert_near(got, [0.6, left(0.0), left(7.0), left(90.0)]);
}

#[test]
fn the_formula_is_three_of_many_recoveries() {
    let one = dented_for(20.0, 4.0);
    let at_s = [2.0, 5.0, 20.0, 40.0, 80.0];
    let weights = (one.definition().curve.as_ref().unwrap().formula)(one.values(), &at_s);
    let depths = [(0.0, 0.6), (2.0, 0.1), (7.0, -1.0), (9.0, 0.2), (90.0, -1.0)];
    assert_near(signals_mm(&free("imprint", [], &at_s, &weights), depths), signals_mm(&one, depths));
}
