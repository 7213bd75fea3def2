use crate::effect::bench::{effect, simulator};
use crate::{Moment, Pipeline, Registration};

/// Places where the tip truly is, robot frame, after each where the stage says it is; the surface stands at 0.
fn ways(play_mm: [f64; 3], stage_mm: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let [x, y, z] = play_mm;
    let mut one = simulator([effect("backlash", [("play_x_mm", x), ("play_y_mm", y), ("play_z_mm", z)])]);
    (one.registration, one.surface_mm) = (Registration { origin_mm: [0.0; 2], rotation_deg: 0.0 }, 0.0);
    let mut pipeline = Pipeline::new(&one).unwrap();
    let step = |(k, tip_mm): (usize, &[f64; 3])| {
        pipeline.step(Moment::at(k as f64), tip_mm);
        let [x, y] = pipeline.contact().position_mm;
        [x, y, -pipeline.contact().depth_mm]
    };
    stage_mm.iter().enumerate().map(step).collect()
}

fn assert_near(got: &[[f64; 3]], want: &[[f64; 3]]) {
    let near = |(got, want): (&f64, &f64)| (got - want).abs() < 1e-12;
    assert!(got.as_flattened().iter().zip(want.as_flattened()).all(near), "{got:?} {want:?}");
}

#[test]
fn one_place_reached_from_both_sides_is_two_places_the_play_apart() {
    let stage = [[1.0, 2.0, -1.0], [3.0, 2.0, -1.0], [5.0, 2.0, -1.0], [3.0, 2.0, -1.0]];
    let want = [[1.0, 2.0, -1.0], [2.9, 2.0, -1.0], [4.9, 2.0, -1.0], [3.1, 2.0, -1.0]];
    assert_near(&ways([0.2, 0.3, 0.1], &stage), &want);
}

#[test]
fn the_tip_rests_until_the_play_is_gone_through() {
    let stage = [0.0, -0.5, -0.45, -0.41, -0.4, -0.35, -0.38].map(|z| [0.0, 0.0, z]);
    // Half the play behind on the way down; up it rests for the whole play; then half behind on the way up.
    let want = [0.0, -0.45, -0.45, -0.45, -0.45, -0.4, -0.4].map(|z| [0.0, 0.0, z]);
    assert_near(&ways([0.0, 0.0, 0.1], &stage), &want);
}

#[test]
fn a_way_in_more_steps_ends_at_the_same_place() {
    let line = |steps: usize| -> Vec<[f64; 3]> {
        let there = (0..=steps).map(|k| k as f64 / steps as f64);
        let back = (0..=steps).map(|k| 1.0 - 0.6 * k as f64 / steps as f64);
        there.chain(back).map(|share| [4.0 * share, -share, -0.5 * share]).collect()
    };
    let last = |steps| ways([0.1, 0.2, 0.3], &line(steps))[2 * steps + 1];
    assert_near(&[last(1)], &[last(50)]);
}
