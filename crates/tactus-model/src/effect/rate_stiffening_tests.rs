use crate::Effect;
use crate::effect::bench::{effect, free, signals_mm};
use crate::effect::{Definition, Knots};

fn stiff(recovery_s: f64) -> Effect {
    effect(
        "rate-stiffening",
        [("stiffening_share", 0.1), ("speed_mm_per_s", 0.5), ("recovery_s", recovery_s)],
    )
}

fn assert_near<const N: usize>(got: [f64; N], want: [f64; N]) {
    let near = got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-9);
    assert!(near, "{got:?} {want:?}");
}

/// By how much a speed of loading raises the response.
fn factor(mm_per_s: f64) -> f64 {
    1.0 + 0.1 * (1.0 + mm_per_s / 0.5).ln()
}

#[test]
fn ten_times_the_speed_adds_a_step_and_no_speed_none() {
    for mm_per_s in [0.1, 1.0, 10.0] {
        // From above the surface; the speed is the same all the way.
        let got = signals_mm(&stiff(1.0), [(0.0, -0.1), (0.3 / mm_per_s, 0.2), (0.6 / mm_per_s, 0.5)]);
        assert_near(got, [0.0, 0.2 * factor(mm_per_s), 0.5 * factor(mm_per_s)]);
    }
    assert_near(signals_mm(&stiff(1.0), [(0.0, 0.5), (1.0, 0.5)]), [0.5, 0.5]);
}

#[test]
fn what_loading_did_dies_away_and_is_forgotten_in_the_air() {
    let got = signals_mm(&stiff(2.0), [(0.0, 0.0), (0.25, 0.5), (1.25, 0.5), (2.25, 0.3), (3.25, -1.0)]);
    let after = |t_s: f64| factor(2.0 * (-t_s / 2.0_f64).exp());
    assert_near(got, [0.0, 0.5 * factor(2.0), 0.5 * after(1.0), 0.3 * after(2.0), 0.0]);
    let [.., last] = signals_mm(&stiff(1e5), [(0.0, 0.0), (0.25, 0.5), (0.5, 0.0), (1.5, 0.1)]);
    assert_near([last], [0.1 * factor(0.1)]);
}

#[test]
fn a_press_in_more_steps_reads_the_same() {
    let at = |k: usize| if k < 30 { 0.5 * k as f64 / 30.0 } else { 0.5 };
    let fine: [_; 61] = std::array::from_fn(|k| (k as f64 / 30.0, at(k)));
    assert_near(
        [signals_mm(&stiff(0.7), fine)[60]],
        [signals_mm(&stiff(0.7), [fine[0], fine[30], fine[60]])[2]],
    );
}

/// A signal that grows while the tool waits is creep.
#[test]
fn a_faster_press_is_never_softer() {
    let softer = Effect::new(
        "rate-stiffening",
        [("stiffening_share", -0.1), ("speed_mm_per_s", 0.5), ("recovery_s", 1.0)],
    );
    assert!(softer.unwrap_err().to_string().contains("from 0 to 2"));
    let knots = Knots { at: vec![0.1, 1.0], values: vec![0.4, 0.2] };
    let definition = Definition::find("rate-stiffening").unwrap();
    let falling = Effect::of_knots(definition, [("recovery_s", 1.0)], knots).unwrap_err().to_string();
    assert!(falling.contains("so that it does not fall"), "{falling}");
}

#[test]
fn knots_give_a_growth_over_the_logarithm_of_the_speed() {
    // Steepest below 1 mm/s, which no logarithm is.
    let step = free("rate-stiffening", [("recovery_s", 1.0)], &[0.1, 1.0, 10.0], &[0.1, 0.4, 0.45]);
    for (mm_per_s, growth) in [(0.05, 0.05), (0.1, 0.1), (10.0_f64.powf(-0.5), 0.25), (1.0, 0.4), (1e3, 0.45)]
    {
        let [_, got] = signals_mm(&step, [(0.0, -0.1), (0.6 / mm_per_s, 0.5)]);
        assert_near([got], [0.5 * (1.0 + growth)]);
    }
}
