#![expect(clippy::float_cmp, reason = "these values are exact")]

use super::{extremes, steps};

#[test]
fn the_lowest_and_the_highest_of_each_column_stay() {
    let mut points: Vec<[f64; 2]> = (0..1000).map(|k| [f64::from(k), f64::from(k % 7)]).collect();
    points[503][1] = 900.0;
    points[504][1] = -900.0;
    points[700][1] = f64::NAN;
    let kept = extremes(&points, 50);
    assert!(kept.len() <= 102, "{}", kept.len());
    assert!(kept.windows(2).all(|pair| pair[0][0] < pair[1][0]));
    assert!(kept.contains(&[503.0, 900.0]) && kept.contains(&[504.0, -900.0]));
}

#[test]
fn few_points_all_stay() {
    let points = [[0.0, 1.0], [0.0, 1.0], [1.0, 2.0]];
    assert_eq!(extremes(&points, 2), points);
    assert_eq!(extremes(&[], 2), Vec::<[f64; 2]>::new());
}

#[test]
fn points_at_one_place_do_not_fail() {
    let kept = extremes(&[[3.0, 1.0]; 100], 10);
    assert!(kept.iter().all(|point| *point == [3.0, 1.0]));
}

#[test]
fn a_histogram_has_an_outline() {
    assert_eq!(steps(1.0, 0.5, &[4]), [[1.0, 0.0], [1.0, 4.0], [1.5, 4.0], [1.5, 0.0]]);
}
