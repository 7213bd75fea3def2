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

#[test]
fn what_is_in_a_gap_is_read_as_a_code_at_one_of_its_ends() {
    let gap =
        [("step_counts", 0.0), ("gap_from_counts", 90.0), ("gap_counts", 16.0), ("gap_low_share", 0.75)];
    let pipeline = Pipeline::new(&simulator([effect("quantisation", gap)])).unwrap();
    let counts = [90.0, 95.0, 101.0, 103.0, 106.0, 107.0];
    assert_eq!(counts.map(|counts| pipeline.read(counts, 0.0)), [90.0, 90.0, 90.0, 106.0, 106.0, 107.0]);
    assert_eq!(pipeline.read(101.0, 1.5), 106.0, "after the noise");
}
