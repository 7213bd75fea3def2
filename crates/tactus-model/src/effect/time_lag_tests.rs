use crate::effect::bench::{effect, simulator, still, upon};
use crate::{Moment, Pipeline, Trail, Trajectory};

#[test]
fn a_late_frame_shows_where_the_tip_was_and_an_early_one_where_it_will_be() {
    let plain = simulator([]);
    let way = Trajectory::new([(0.0, upon(&plain, 20, 0.0)), (2.0, upon(&plain, 22, 0.5))]).unwrap();
    for lag_s in [0.125, -0.25] {
        let late = simulator([effect("time-lag", [("lag_s", lag_s)])]);
        let counts = Pipeline::new(&late).unwrap().step(Moment::at(1.0), &way).to_vec();
        assert_eq!(counts, still(&plain, way.at(1.0 - lag_s)));
    }
}

#[test]
fn a_device_that_knows_no_future_is_late_by_its_trail() {
    let late = simulator([effect("time-lag", [("lag_s", 0.1)])]);
    let depth_mm = |t_s: f64| 0.4 * t_s;
    let mut trail = Trail::new(0.0, upon(&late, 21, 0.0));
    let mut pipeline = Pipeline::new(&late).unwrap();
    for k in 1..=30 {
        let t_s = f64::from(k) / 30.0;
        trail.push(t_s, upon(&late, 21, depth_mm(t_s)));
        pipeline.step(Moment::at(t_s), &trail);
    }
    let want = still(&simulator([]), upon(&late, 21, depth_mm(0.9)));
    assert!((pipeline.counts()[21] - want[21]).abs() < 1e-9);
}
