use crate::Effect;
use crate::effect::bench::{assert_slopes, effect, felt_mm};

fn lossy(loss_share: f64, threshold_mm: f64) -> Effect {
    effect("hysteresis", [("loss_share", loss_share), ("threshold_mm", threshold_mm)])
}

fn assert_near<const N: usize>(got: [f64; N], want: [f64; N]) {
    let near = got.iter().zip(want).all(|(got, want)| (got - want).abs() < 1e-9);
    assert!(near, "{got:?} {want:?}");
}

#[test]
fn loading_is_the_base_models_and_unloading_is_lower() {
    // Plays of 0.05, 0.1, 0.15 and 0.2 mm: back by 0.1, what is held on to is 0.05 once and 0.1 three times.
    let depths = [0.2, 0.5, 0.4, 0.25, 0.0].map(|depth_mm| (depth_mm, depth_mm));
    let lost = [0.0, 0.0, 0.4 * 0.0875, 0.4 * 0.125, 0.0];
    assert_near(felt_mm(&lossy(0.4, 0.2), depths), [0.2, 0.5, 0.4 - lost[2], 0.25 - lost[3], 0.0]);
    // A negative share holds more, and leaves a rest.
    assert_near(felt_mm(&lossy(-0.4, 0.2), depths), [0.2, 0.5, 0.4 + lost[2], 0.25 + lost[3], 0.05]);
}

#[test]
fn the_same_way_gives_the_same_at_any_rate() {
    let depths = [0.3, 0.5, 0.2, 0.45, 0.1];
    let one = lossy(0.4, 0.2);
    let at = |per_s: f64| {
        let mut k = 0.0;
        felt_mm(
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
    let [_, outer] = felt_mm(&lossy(0.4, 0.2), straight);
    let [.., inner] =
        felt_mm(&lossy(0.4, 0.2), [(0.0, 0.5), (1.0, 0.35), (2.0, 0.42), (3.0, 0.35), (4.0, 0.2)]);
    assert_near([inner], [outer]);
    let [.., up] = felt_mm(&lossy(0.4, 0.2), [(0.0, 0.5), (1.0, 0.2), (2.0, 0.5)]);
    assert_near([up], [0.5]);
}

#[test]
fn a_loop_encloses_the_area_of_its_plays() {
    // A play's loop between two depths is a parallelogram: its threshold high, and as long as is left of the way.
    const STEPS: usize = 2000;
    let depth_mm = |k: usize| {
        let along = (k % STEPS) as f64 / STEPS as f64;
        if (k / STEPS).is_multiple_of(2) { 0.1 + 0.4 * along } else { 0.5 - 0.4 * along }
    };
    let depths: [_; 4 * STEPS + 1] = std::array::from_fn(|k| (k as f64, depth_mm(k)));
    let felt = felt_mm(&lossy(0.3, 0.2), depths);
    // Second time round, and past the first half so that the loop is closed.
    let work = |k: usize| 0.5 * (felt[k] + felt[k + 1]) * (depths[k + 1].1 - depths[k].1);
    let area: f64 = (2 * STEPS..4 * STEPS).map(work).sum();
    let want: f64 = [0.05, 0.1, 0.15, 0.2].iter().map(|r| 0.3 * r * (0.4 - r)).sum::<f64>() / 4.0;
    assert!((area - want).abs() < 1e-4 * want, "{area} {want}");
}

#[test]
fn derivatives_are_those_of_differences() {
    assert_slopes(&lossy(0.3, 0.7), &["loss_share", "threshold_mm"]);
}
