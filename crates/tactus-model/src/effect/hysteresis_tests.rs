use crate::Effect;
use crate::effect::bench::{effect, free, signals_mm};

fn lossy(loss_share: f64, threshold_mm: f64) -> Effect {
    growing(loss_share, threshold_mm, 0.0)
}

fn growing(loss_share: f64, threshold_mm: f64, growth: f64) -> Effect {
    let shape = [
        ("loss_share", loss_share),
        ("threshold_mm", threshold_mm),
        ("threshold_growth", growth),
        ("by_depth", 0.0),
    ];
    effect("hysteresis", shape)
}

fn assert_near<const N: usize>(got: [f64; N], want: [f64; N]) {
    let near = got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-9);
    assert!(near, "{got:?} {want:?}");
}

#[test]
fn what_is_held_is_a_threshold_behind_and_then_a_threshold_before() {
    // Plays of 0.05, 0.15, 0.25 and 0.4 mm. At 0.5 mm they hold 0.45, 0.35, 0.25 and 0.1; at 0.2 mm the first has
    // been crossed and is 0.05 before.
    let depths = [0.02, 0.5, 0.2, 0.0].map(|depth_mm| (depth_mm, depth_mm));
    let held = [0.0, 1.15 / 4.0, 0.95 / 4.0];
    let want = |loss: f64| [0.02, 0.5, 0.2].map(|u| u * (1.0 + loss)).into_iter().zip(held);
    let [a, b, c] = [0, 1, 2].map(|k| want(0.4).map(|(u, held)| u - 0.4 * held).nth(k).unwrap());
    assert_near(signals_mm(&lossy(0.4, 0.4), depths), [a, b, c, 0.0]);
    // A negative share leaves a rest: of what is held, 0.05, 0.15, 0.25 and 0.1 mm.
    let [.., rest] = signals_mm(&lossy(-0.4, 0.4), depths);
    assert_near([rest], [0.4 * 0.55 / 4.0]);
}

#[test]
fn a_growing_threshold_is_in_proportion_to_what_is_held() {
    // 0.5 mm is 1 + s/2 times what is held and a threshold of s/5.
    let [_, up, down] = signals_mm(&growing(0.4, 0.2, 0.5), [(0.0, 0.0), (1.0, 0.5), (2.0, 0.02)]);
    let shares = [0.125, 0.375, 0.625, 1.0];
    let held = shares.map(|s: f64| (0.5 - 0.2 * s) / (1.0 + 0.5 * s));
    assert_near([up], [0.5 - 0.4 * (held.iter().sum::<f64>() / 4.0 - 0.5)]);
    let held = shares.iter().zip(held).map(|(s, held)| ((0.02 + 0.2 * s) / (1.0 - 0.5 * s)).min(held));
    assert_near([down], [(0.02 - 0.4 * (held.sum::<f64>() / 4.0 - 0.02)).max(0.0)]);
}

#[test]
fn the_same_way_gives_the_same_at_any_rate() {
    let depths = [0.3, 0.5, 0.2, 0.45, 0.1];
    let one = lossy(0.4, 0.2);
    let at = |per_s: f64| {
        let mut k = 0.0;
        signals_mm(
            &one,
            depths.map(|depth_mm| {
                k += 1.0;
                (k / per_s, depth_mm)
            }),
        )
    };
    assert_near(at(0.01), at(100.0));
}

#[test]
fn an_inner_loop_leads_back_to_the_outer_one() {
    let straight = [(0.0, 0.5), (1.0, 0.2)];
    let [_, outer] = signals_mm(&lossy(0.4, 0.2), straight);
    let [.., inner] =
        signals_mm(&lossy(0.4, 0.2), [(0.0, 0.5), (1.0, 0.35), (2.0, 0.42), (3.0, 0.35), (4.0, 0.2)]);
    assert_near([inner], [outer]);
    let [first, _, again] = signals_mm(&lossy(0.4, 0.2), [(0.0, 0.5), (1.0, 0.2), (2.0, 0.5)]);
    assert_near([again], [first]);
}

#[test]
fn knots_are_the_weights_of_plays() {
    // Two plays of their own weights: at 0.5 mm they hold 0.4 and 0.2, at 0.15 mm the first is crossed and holds 0.25.
    let kept = [("threshold_growth", 0.0), ("by_depth", 0.0)];
    let two = free("hysteresis", kept, &[0.1, 0.3], &[0.5, 0.2]);
    let got = signals_mm(&two, [(0.0, 0.0), (1.0, 0.5), (2.0, 0.15)]);
    let lost = |u: f64, held: [f64; 2]| 0.5 * (held[0] - u) + 0.2 * (held[1] - u);
    assert_near(got, [0.0, 0.5 - lost(0.5, [0.4, 0.2]), 0.15 - lost(0.15, [0.25, 0.2])]);
}

#[test]
fn the_formula_is_four_of_many_plays() {
    let one = growing(0.4, 0.16, 0.2);
    let at_mm = [0.02, 0.04, 0.06, 0.1, 0.16];
    let weights = (one.definition().curve.as_ref().unwrap().formula)(one.values(), &at_mm);
    let kept = [("threshold_growth", 0.2), ("by_depth", 0.0)];
    let depths = [(0.0, 0.3), (1.0, 0.6), (2.0, 0.4), (3.0, 0.45), (4.0, 0.1)];
    assert_near(signals_mm(&free("hysteresis", kept, &at_mm, &weights), depths), signals_mm(&one, depths));
}

#[test]
fn a_loop_encloses_the_area_of_its_plays() {
    // A play's loop between two depths is a parallelogram: twice its threshold high, and as long as is left of the way.
    const STEPS: usize = 2000;
    let depth_mm = |k: usize| {
        let along = (k % STEPS) as f64 / STEPS as f64;
        if (k / STEPS).is_multiple_of(2) { 0.1 + 0.4 * along } else { 0.5 - 0.4 * along }
    };
    let depths: [_; 4 * STEPS + 1] = std::array::from_fn(|k| (k as f64, depth_mm(k)));
    let signals = signals_mm(&lossy(0.3, 0.1), depths);
    // Second time round, and past the first half so that the loop is closed.
    let work = |k: usize| 0.5 * (signals[k] + signals[k + 1]) * (depths[k + 1].1 - depths[k].1);
    let area: f64 = (2 * STEPS..4 * STEPS).map(work).sum();
    let want =
        [0.0125, 0.0375, 0.0625, 0.1].map(|r: f64| 0.3 * 2.0 * r * (0.4 - 2.0 * r)).iter().sum::<f64>() / 4.0;
    assert!((area - want).abs() < 1e-4 * want, "{area} {want}");
}
