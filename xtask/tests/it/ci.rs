//! CI's steps and the seconds that each may take: `.ci/run` and `.ci/allowed.toml`.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::collections::BTreeMap;

use serde::Deserialize;

const RUN: &str = include_str!("../../../.ci/run");
const ALLOWED: &str = include_str!("../../../.ci/allowed.toml");

/// A fresh clone on two quiet cores.
const TOTAL_S: u64 = 25 * 60;

#[derive(Deserialize)]
struct Allowed {
    slow_machine: f64,
    seconds: BTreeMap<String, u64>,
}

/// The names of the steps in a part of the script, in their order.
fn steps(script: &str) -> Vec<&str> {
    script.lines().filter_map(|line| line.trim().strip_prefix("step ")?.split(' ').next()).collect()
}

/// The steps of the lane that waits, and those of the lane that computes.
fn lanes() -> [Vec<&'static str>; 2] {
    let (_, waits) = RUN.split_once("waits() {").unwrap();
    let (waits, computes) = waits.split_once("\n}").unwrap();
    [steps(waits), steps(computes)]
}

#[test]
fn every_step_has_its_allowance() {
    let allowed: Allowed = toml::from_str(ALLOWED).unwrap();
    let mut named: Vec<&str> = lanes().concat();
    named.push("total");
    named.sort_unstable();
    assert_eq!(allowed.seconds.keys().collect::<Vec<_>>(), named);
    assert!(allowed.slow_machine * TOTAL_S as f64 <= 90.0 * 60.0, "work that takes longer does not land");
}

#[test]
fn the_allowances_of_each_lane_fit_into_the_total() {
    let allowed: Allowed = toml::from_str(ALLOWED).unwrap();
    assert!(allowed.seconds["total"] <= TOTAL_S);
    for lane in lanes() {
        let sum: u64 = lane.iter().map(|step| allowed.seconds[*step]).sum();
        assert!(!lane.is_empty() && sum <= TOTAL_S, "{lane:?} may take {sum} s");
    }
}
