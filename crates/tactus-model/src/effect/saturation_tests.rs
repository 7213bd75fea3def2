use crate::effect::bench::{effect, free, linear, signals_mm, upon};
use crate::{Effect, ForwardModel, Moment, Pipeline};

fn level(loss_at_1_mm: f64, knee: f64) -> Effect {
    effect("saturation", [("loss_at_1_mm", loss_at_1_mm), ("knee", knee)])
}

fn assert_near<const N: usize>(got: [f64; N], want: [f64; N], within: f64) {
    let near = got.iter().zip(want).all(|(got, want)| (got - want).abs() < within);
    assert!(near, "{got:?} {want:?}");
}

#[test]
fn a_knee_of_one_is_the_hyperbola() {
    // Half is lost at 1 mm: u / (1 + u).
    let got = signals_mm(&level(0.5, 1.0), [(0.0, 0.25), (0.0, 0.5), (0.0, 1.0)]);
    assert_near(got, [0.2, 1.0 / 3.0, 0.5], 1e-12);
}

#[test]
fn a_sharp_knee_is_a_kink_at_the_ceiling() {
    let got = signals_mm(&level(0.6, 12.0), [(0.0, 0.1), (0.0, 0.3), (0.0, 0.6), (0.0, 1.0)]);
    assert_near(got, [0.1, 0.3, 0.4, 0.4], 1e-3);
    let [least, ..] = got;
    assert!((least - 0.1).abs() < 1e-8, "small signals are as they were: {least}");
}

#[test]
fn a_fit_can_start_from_none() {
    let [none, some] = [0.0, 1e-6].map(|loss| signals_mm(&level(loss, 2.0), [(0.0, 0.5)]));
    assert_near([(none[0] - some[0]) / 1e-6], [0.5_f64.powi(3)], 1e-5);
}

#[test]
fn knots_give_a_loss_of_any_shape() {
    // Only what lies between 0.2 and 0.4 mm is lost in part, which no knee can do.
    let step = free("saturation", [], &[0.2, 0.4], &[0.0, 0.3]);
    let got = signals_mm(&step, [(0.0, 0.1), (0.0, 0.3), (0.0, 0.4), (0.0, 0.9)]);
    assert_near(got, [0.1, 0.3 * 0.85, 0.4 * 0.7, 0.9 * 0.7], 1e-12);
}

#[test]
fn an_amplifier_ends_at_the_same_counts_whatever_the_gain() {
    // Elements of 1250 and 750 counts/mm, whose mean is that of all, pressed by 0.8 mm; the ceiling is 0.4 mm of the mean gain.
    let at_most = |counts_share: f64| {
        let saturated = level(0.6, 12.0).with("counts_share", counts_share).unwrap();
        let mut one = linear([saturated]);
        let mut response = one.model.response().clone();
        (response.sensitivity_counts_per_mm[21], response.sensitivity_counts_per_mm[22]) = (1250.0, 750.0);
        one.model = ForwardModel::new(one.model.array().clone(), one.model.psf(), response).unwrap();
        [21, 22].map(|element| {
            let mut pipeline = Pipeline::new(&one).unwrap();
            pipeline.step(Moment::at(0.0), &upon(&one, element, 0.8))[element]
        })
    };
    assert_near(at_most(1.0), [400.0, 400.0], 0.5);
    assert_near(at_most(0.0), [500.0, 300.0], 0.5);
}
