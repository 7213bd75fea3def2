use crate::effect::bench::{assert_slopes, effect, linear, still, upon};
use crate::{Moment, Pipeline};

/// Down upon element 21 within a second, and up again within the next.
fn depth_mm(t_s: f64) -> f64 {
    if t_s < 1.0 { 0.5 * t_s } else { 1.0 - 0.5 * t_s }.max(0.0)
}

#[test]
fn every_element_shows_the_instant_of_its_own_sample() {
    // A scan of 47 steps of 4 ms is longer than a frame of 1/32 s.
    let one = linear([effect("scan-skew", [("element_time_s", 0.004)])]);
    let mut pipeline = Pipeline::new(&one).unwrap();
    let full = still(&linear([]), upon(&one, 21, 0.5));
    for frame in 0..64 {
        let t_s = f64::from(frame) / 32.0;
        let got = pipeline.step(Moment::at(t_s), &upon(&one, 21, depth_mm(t_s)));
        for (element, (got, full)) in got.iter().zip(&full).enumerate() {
            // A flat tool's signal is in proportion to depth.
            let want = full * depth_mm((t_s - 0.004 * (47 - element) as f64).max(0.0)) / 0.5;
            assert!((got - want).abs() < 1e-9, "frame {frame}, element {element}: {got} {want}");
        }
    }
}

#[test]
fn frames_at_any_rate_show_the_same() {
    let one = linear([effect("scan-skew", [("element_time_s", 0.004)])]);
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

#[test]
fn the_derivative_is_that_of_differences() {
    assert_slopes(&effect("scan-skew", [("element_time_s", 0.0093)]), &["element_time_s"]);
}
