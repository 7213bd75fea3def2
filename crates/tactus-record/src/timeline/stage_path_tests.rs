use tactus_schema::MonoTime;

use super::{StageReport, position_mm};

fn at(s: f64) -> MonoTime {
    #[expect(clippy::cast_possible_truncation, reason = "times of a test")]
    MonoTime::from_ns((s * 1e9).round() as i64)
}

/// Down from 1 s on at 2 mm/s for 0.5 s, a rest of 1 s, up at 5 mm/s.
fn path_mm(s: f64) -> [f64; 3] {
    let down = -2.0 * (s - 1.0).clamp(0.0, 0.5);
    let up = 5.0 * (s - 2.5).clamp(0.0, 0.2);
    [3.0, 0.5 * s, down + up]
}

fn reports() -> Vec<StageReport> {
    (0..90)
        .map(|k| f64::from(k) * 0.045)
        .map(|s| StageReport { at: at(s), position_mm: path_mm(s), stands: false })
        .collect()
}

#[test]
fn a_stage_that_starts_and_stops_between_reports_is_where_it_was() {
    let reports = reports();
    for k in 0..400 {
        let s = 0.01 * f64::from(k);
        let got = position_mm(&reports, at(s)).unwrap();
        for (got, want) in got.into_iter().zip(path_mm(s)) {
            assert!((got - want).abs() < 1e-6, "{s} s: {got} mm, not {want} mm");
        }
    }
}

#[test]
fn without_neighbours_it_is_the_straight_line_and_beyond_them_the_last_word() {
    let reports = [
        StageReport { at: at(1.0), position_mm: [0.0, 0.0, 2.0], stands: false },
        StageReport { at: at(2.0), position_mm: [1.0, 0.0, 0.0], stands: false },
    ];
    assert_eq!(position_mm(&reports, at(1.25)), Some([0.25, 0.0, 1.5]));
    assert_eq!(position_mm(&reports, at(0.5)), Some([0.0, 0.0, 2.0]));
    assert_eq!(position_mm(&reports, at(3.0)), Some([1.0, 0.0, 0.0]));
    assert_eq!(position_mm(&[], at(1.0)), None);
}

/// Down by 0.1 mm at 1 mm/s, a stop of 5 ms, and on: four times.
fn stepping_mm(s: f64) -> [f64; 3] {
    let steps = (s / 0.105).floor().clamp(0.0, 4.0);
    let within_mm = if steps < 4.0 { (s - 0.105 * steps).clamp(0.0, 0.1) } else { 0.0 };
    [0.0, 0.0, -0.1 * steps - within_mm]
}

#[test]
fn a_stage_that_stops_for_a_moment_was_there_before_it_said_so() {
    // A report every 50 ms in motion, and one in each stop.
    let stop = |k: i32| 0.105 * f64::from(k) - 0.003;
    let mut times_s: Vec<(f64, bool)> = (1..=4).map(|k| (stop(k), true)).collect();
    times_s.extend((0..4).flat_map(|k| [0.002, 0.052].map(|s| (0.105 * f64::from(k) + s, false))));
    times_s.extend([-0.05, 0.0, 0.47, 0.52].map(|s| (s, true)));
    times_s.sort_by(|one, other| one.0.total_cmp(&other.0));
    let reports: Vec<StageReport> = times_s
        .into_iter()
        .map(|(s, stands)| StageReport { at: at(1.0 + s), position_mm: stepping_mm(s.max(0.0)), stands })
        .collect();
    for k in 0..500 {
        let s = 0.001 * f64::from(k);
        let [_, _, got] = position_mm(&reports, at(1.0 + s)).unwrap();
        let [_, _, want] = stepping_mm(s);
        assert!((got - want).abs() < 1e-6, "{s} s: {got} mm, not {want} mm");
    }
}

#[test]
fn a_move_that_one_report_saw_ends_before_the_stage_says_that_it_stands() {
    // 0.01 mm at 1 mm/s, from 1 s on.
    let reports = [(0.999, 0.0, true), (1.004, -0.004, false), (1.05, -0.01, true), (1.1, -0.01, true)];
    let reports = reports.map(|(s, z, stands)| StageReport { at: at(s), position_mm: [0.0, 0.0, z], stands });
    for (s, want) in [(1.002, -0.002), (1.007, -0.007), (1.02, -0.01), (1.04, -0.01)] {
        let [_, _, got] = position_mm(&reports, at(s)).unwrap();
        assert!((got - want).abs() < 1e-3, "{s} s: {got} mm, not {want} mm");
    }
}
