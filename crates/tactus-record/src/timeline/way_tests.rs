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
        .map(|s| StageReport { at: at(s), position_mm: path_mm(s) })
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
        StageReport { at: at(1.0), position_mm: [0.0, 0.0, 2.0] },
        StageReport { at: at(2.0), position_mm: [1.0, 0.0, 0.0] },
    ];
    assert_eq!(position_mm(&reports, at(1.25)), Some([0.25, 0.0, 1.5]));
    assert_eq!(position_mm(&reports, at(0.5)), Some([0.0, 0.0, 2.0]));
    assert_eq!(position_mm(&reports, at(3.0)), Some([1.0, 0.0, 0.0]));
    assert_eq!(position_mm(&[], at(1.0)), None);
}
