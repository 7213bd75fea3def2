#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::*;
use crate::effect::bench::{effect, simulator, upon};

#[test]
fn images_come_at_the_rate_from_the_trajectorys_start() {
    let one = simulator([]);
    let rest = Trajectory::new([(2.0, upon(&one, 21, 0.5))]).unwrap();
    let times: Vec<_> = one.run(&rest, 4.0, 4, || 0.0).unwrap().map(|image| image.t_s).collect();
    assert_eq!(times, [2.0, 2.25, 2.5, 2.75]);
}

#[test]
fn the_drawn_noise_comes_upon_the_clean_counts_before_the_converter() {
    let noisy = Simulator { noise_rms_counts: 2.0, ..simulator([]) };
    let rest = Trajectory::new([(0.0, upon(&noisy, 21, 0.5))]).unwrap();
    let mut deviate = 0.0;
    let draw = || {
        deviate += 0.25;
        deviate
    };
    let image = noisy.run(&rest, 30.0, 1, draw).unwrap().next().unwrap();
    for (element, (clean, read)) in image.clean_counts.iter().zip(&image.counts).enumerate() {
        assert_eq!(*read, (clean + 2.0 * 0.25 * (element as f64 + 1.0)).round());
    }
}

#[test]
fn copies_share_nothing_and_every_run_begins_without_a_past() {
    let one = simulator([effect(
        "relaxation",
        [
            ("relaxed_share", 0.5),
            ("time_constant_s", 1.0),
            ("spread_ratio", 1.0),
            ("after_release", 0.0),
            ("recovery_ratio", 1.0),
        ],
    )]);
    let other = one.clone();
    let hold = Trajectory::new([(0.0, upon(&one, 21, 0.5))]).unwrap();
    let images = |one: &Simulator| -> Vec<Image> { one.run(&hold, 30.0, 60, || 0.0).unwrap().collect() };
    let first = images(&one);
    assert!(first[59].counts[21] < first[0].counts[21]);
    assert_eq!(images(&one), first);
    assert_eq!(images(&other), first);
}
