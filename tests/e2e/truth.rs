//! Calibration recovers the truth: `tactus-bench truth` measures simulated rigs with different true parameters and calibrates them.
//!
//! Two rigs and a coarse sweep show that nothing is broken, not that the intervals are right: `just truth` takes 200 rigs and the paper's sweep,
//! and prints the table of `docs/calibration-evidence.md`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use tactus_e2e::{binary, computed};
use tempfile::TempDir;

#[test]
fn calibration_recovers_the_true_parameters_of_simulated_rigs() {
    let folder = TempDir::new().unwrap();
    let tactus = binary("tactus").display().to_string();
    let truth = ["truth", "--rigs", "2", "--points", "5", "--tactus", &tactus, "--work", "truth"];
    let said = computed("tactus-bench", folder.path(), &truth);
    assert_eq!(said.code, Some(0), "{said:?}");
    for line in [
        "rigs: 2 done, 0 by other workers, 0 before",
        "2 rigs, sweep of 5 x 5 points",
        "sigma, 5.080 mm",
        "0 missed",
    ] {
        assert!(said.out.contains(line), "{said:?}");
    }
    let again = computed("tactus-bench", folder.path(), &truth);
    let table = |out: &str| out.split_once("2 rigs, sweep").map(|(_, table)| table.to_owned());
    assert!(again.out.contains("rigs: 0 done, 0 by other workers, 2 before"), "{again:?}");
    assert_eq!(table(&again.out), table(&said.out));
    let other = computed("tactus-bench", folder.path(), &[&truth[..4], &["6"], &truth[5..]].concat());
    assert_eq!(other.code, Some(1));
    assert!(other.err.contains("are of points 5, not of 6"), "{other:?}");
}
