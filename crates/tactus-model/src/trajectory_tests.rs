#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::*;

fn bend() -> Trajectory {
    Trajectory::new([(1.0, [0.0, 0.0, 2.0]), (3.0, [4.0, 0.0, 2.0]), (3.5, [4.0, 0.0, -0.5])]).unwrap()
}

#[test]
fn the_way_is_straight_between_points_and_ends_at_the_ends() {
    let bend = bend();
    for (t_s, want_mm) in [
        (-7.0, [0.0, 0.0, 2.0]),
        (1.0, [0.0, 0.0, 2.0]),
        (1.5, [1.0, 0.0, 2.0]),
        (3.0, [4.0, 0.0, 2.0]),
        (3.25, [4.0, 0.0, 0.75]),
        (3.5, [4.0, 0.0, -0.5]),
        (99.0, [4.0, 0.0, -0.5]),
    ] {
        assert_eq!(bend.at(t_s), want_mm, "at {t_s} s");
    }
    assert_eq!((bend.start_s(), bend.end_s()), (1.0, 3.5));
}

#[test]
fn velocity_is_that_of_the_piece_which_begins() {
    let bend = bend();
    assert_eq!(bend.velocity_mm_per_s(0.9), [0.0; 3]);
    assert_eq!(bend.velocity_mm_per_s(1.0), [2.0, 0.0, 0.0]);
    assert_eq!(bend.velocity_mm_per_s(3.0), [0.0, 0.0, -5.0]);
    assert_eq!(bend.velocity_mm_per_s(3.5), [0.0; 3]);
}

#[test]
fn a_time_that_is_no_number_gives_an_end() {
    assert_eq!(bend().at(f64::NAN), [0.0, 0.0, 2.0]);
    assert_eq!(bend().at(f64::INFINITY), [4.0, 0.0, -0.5]);
}

#[test]
fn points_out_of_order_or_not_finite_are_refused_by_index() {
    assert_eq!(Trajectory::new([]), Err(TrajectoryError::Empty));
    let twice = Trajectory::new([(0.0, [0.0; 3]), (1.0, [0.0; 3]), (1.0, [1.0; 3])]);
    assert_eq!(twice, Err(TrajectoryError::Order { index: 2, t_s: 1.0, before_s: 1.0 }));
    let nowhere = Trajectory::new([(0.0, [0.0, f64::INFINITY, 0.0])]);
    assert!(matches!(nowhere, Err(TrajectoryError::NotFinite { index: 0, .. })));
}
