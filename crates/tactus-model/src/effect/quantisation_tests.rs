#![expect(clippy::float_cmp, reason = "these values are exact")]

use crate::Pipeline;
use crate::effect::bench::{effect, simulator};

fn read(step_counts: f64, counts: f64, noise_counts: f64) -> f64 {
    let coarse = simulator([effect("quantisation", [("step_counts", step_counts)])]);
    Pipeline::new(&coarse).unwrap().read(counts, noise_counts)
}

#[test]
fn readings_come_in_coarse_steps_after_the_noise() {
    assert_eq!(read(4.0, 101.6, 0.0), 100.0, "not by way of 102");
    assert_eq!(read(4.0, 101.6, 0.5), 104.0);
    assert_eq!(read(4.0, -3.0, 0.0), 0.0);
    assert_eq!(read(4.0, 1e6, 0.0), 4095.0, "the declared converter ends where it did");
}
