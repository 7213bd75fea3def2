use super::{WayPoint, bends};

fn way(heights_mm: &[f64]) -> Vec<WayPoint> {
    let point = |(place, z_mm): (usize, &f64)| WayPoint {
        before: 7,
        t_s: place as f64,
        position_mm: [1.0, 2.0, *z_mm],
        press: 3,
    };
    heights_mm.iter().enumerate().map(point).collect()
}

fn times(way: &[WayPoint]) -> Vec<f64> {
    way.iter().map(|point| point.t_s).collect()
}

#[test]
fn a_press_keeps_its_corners() {
    let press = [0.2, 0.1, 0.0, -0.1, -0.2, -0.3, -0.3, -0.3, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2];
    assert_eq!(times(&bends(&way(&press), 0.01)), [0.0, 5.0, 8.0, 13.0]);
}

#[test]
fn what_a_stage_trembles_is_no_corner() {
    let rest: Vec<f64> = (0..50).map(|place| -0.3 + 0.004 * f64::from(place % 3)).collect();
    assert_eq!(times(&bends(&way(&rest), 0.01)), [0.0, 49.0]);
}

#[test]
fn moves_clear_of_the_surface_are_no_corners() {
    let moves = [1.0, 5.0, 5.0, 3.0, 9.0, 1.0];
    assert_eq!(times(&bends(&way(&moves), 0.01)), [0.0, 5.0]);
}

#[test]
fn a_line_through_the_surface_where_the_tip_was_clear_is_off() {
    let above = [-0.5, 0.1, 3.0, 3.0, 3.0, 0.1, -0.5];
    assert_eq!(times(&bends(&way(&above), 0.01)), [0.0, 1.0, 4.0, 5.0, 6.0]);
}

#[test]
fn short_ways_are_kept() {
    for length in 0..3 {
        let way = way(&vec![0.0; length]);
        assert_eq!(bends(&way, 0.01), way);
    }
}
