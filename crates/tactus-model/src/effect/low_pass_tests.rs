#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::effect::bench::{effect, simulator, upon};
use crate::{Moment, Pipeline};

#[test]
fn a_jump_is_followed_exponentially_from_a_settled_start() {
    let slow = simulator([effect("low-pass", [("time_constant_s", 0.2)])]);
    let (up, down) = (upon(&slow, 21, -1.0), upon(&slow, 21, 0.5));
    let full = crate::effect::bench::still(&slow, down)[21];
    let mut pipeline = Pipeline::new(&slow).unwrap();
    assert_eq!(pipeline.step(Moment::at(0.0), &up)[21], 100.0);
    pipeline.step(Moment::at(0.0), &down);
    for t_s in [0.01, 0.1, 0.5] {
        let want = full + (100.0 - full) * (-t_s / 0.2_f64).exp();
        assert!((pipeline.step(Moment::at(t_s), &down)[21] - want).abs() < 1e-9, "after {t_s} s");
    }
}
