use crate::effect::bench::{effect, linear, still, upon};
use crate::{Effect, Moment, Pipeline};

fn skew(row_time_s: f64, column_time_s: f64) -> Effect {
    effect("scan-skew", [("row_time_s", row_time_s), ("column_time_s", column_time_s)])
}

/// Down upon element 21 within a second, and up again within the next.
fn depth_mm(t_s: f64) -> f64 {
    if t_s < 1.0 { 0.5 * t_s } else { 1.0 - 0.5 * t_s }.max(0.0)
}

#[test]
fn every_element_shows_the_instant_of_its_own_sample() {
    // Elements one by one, rows at once and columns at once; a scan is longer than a frame of 1/32 s.
    for (row_time_s, column_time_s) in [(0.032, 0.004), (0.03, 0.0), (0.0, 0.03)] {
        every_element_shows(row_time_s, column_time_s);
    }
}

fn every_element_shows(row_time_s: f64, column_time_s: f64) {
    let one = linear([skew(row_time_s, column_time_s)]);
    let mut pipeline = Pipeline::new(&one).unwrap();
    let full = still(&linear([]), upon(&one, 21, 0.5));
    for frame in 0..64 {
        let t_s = f64::from(frame) / 32.0;
        let got = pipeline.step(Moment::at(t_s), &upon(&one, 21, depth_mm(t_s)));
        for (element, (got, full)) in got.iter().zip(&full).enumerate() {
            // A flat tool's signal is in proportion to depth.
            let age_s = (5 - element / 8) as f64 * row_time_s + (7 - element % 8) as f64 * column_time_s;
            let want = full * depth_mm((t_s - age_s).max(0.0)) / 0.5;
            assert!((got - want).abs() < 1e-9, "frame {frame}, element {element}: {got} {want}");
        }
    }
}

#[test]
fn frames_at_any_rate_show_the_same() {
    let one = linear([skew(0.032, 0.004)]);
    let last = |frames: u32| {
        let mut pipeline = Pipeline::new(&one).unwrap();
        for frame in 0..=frames {
            let t_s = 0.75 * f64::from(frame) / f64::from(frames);
            pipeline.step(Moment::at(t_s), &upon(&one, 21, depth_mm(t_s)));
        }
        pipeline.counts().to_vec()
    };
    for (few, many) in last(3).iter().zip(last(3000)) {
        assert!((few - many).abs() < 1e-9, "{few} {many}");
    }
}
