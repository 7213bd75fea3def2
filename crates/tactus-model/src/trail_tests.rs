#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::*;
use crate::Trajectory;

#[test]
fn a_trail_is_the_trajectory_of_its_places() {
    let points = [(0.0, [1.0, 2.0, 3.0]), (0.25, [2.0, 2.0, 1.0]), (0.5, [2.5, 0.0, 1.0]), (1.0, [0.0; 3])];
    let mut trail = Trail::new(points[0].0, points[0].1);
    for (t_s, position_mm) in &points[1..] {
        trail.push(*t_s, *position_mm);
    }
    let trajectory = Trajectory::new(points).unwrap();
    for t_s in [-1.0, 0.0, 0.125, 0.25, 0.3, 0.75, 1.0, 2.0] {
        assert_eq!(trail.at(t_s), trajectory.at(t_s), "at {t_s} s");
    }
}

#[test]
fn what_nothing_asks_for_is_forgotten() {
    let mut trail = Trail::new(0.0, [0.0; 3]);
    for k in 1..=1000 {
        trail.push(f64::from(k) / 8.0, [f64::from(k), 0.0, 0.0]);
    }
    assert!(trail.earlier.len() < 12);
    assert_eq!(trail.at(124.0)[0], 992.0);
}

#[test]
fn a_place_at_the_same_time_takes_the_lasts_stead() {
    let mut trail = Trail::new(1.0, [1.0; 3]);
    trail.push(1.0, [2.0; 3]);
    trail.push(0.5, [3.0; 3]);
    assert_eq!((trail.at(0.0), trail.at(5.0)), ([3.0; 3], [3.0; 3]));
}
