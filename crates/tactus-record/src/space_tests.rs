use tactus_schema::Rig;

use super::{FREE_MIN_BYTES, check_free, free_bytes, needed_bytes};
use crate::RecordError;

const RIG_TOML: &str = include_str!("../../../config/rigs/sim.toml");

#[test]
fn a_run_needs_space_for_its_duration_and_a_minimum() {
    let rig = Rig::from_toml(RIG_TOML).unwrap();
    assert_eq!(needed_bytes(&rig, None), FREE_MIN_BYTES);
    assert_eq!(needed_bytes(&rig, Some(60.0)), FREE_MIN_BYTES);
    let hour = needed_bytes(&rig, Some(3600.0));
    let day = needed_bytes(&rig, Some(86_400.0));
    // 30 frames/s of 48 elements: 4 bytes each, and as much again for the rest.
    assert!(day > 20 * hour && day > 86_400 * 30 * 48 * 4, "{hour}, {day}");
    assert!(day < 86_400 * 30 * 48 * 4 * 5, "{day}");
}

#[test]
fn a_run_that_does_not_fit_is_refused_with_what_to_do() {
    let rig = Rig::from_toml(RIG_TOML).unwrap();
    let folder = tempfile::tempdir().unwrap();
    check_free(folder.path(), &rig, None).unwrap();
    let error = check_free(folder.path(), &rig, Some(1e13)).unwrap_err();
    assert!(matches!(error, RecordError::NoSpace { .. }));
    let text = error.to_string();
    let free = free_bytes(folder.path()).unwrap() / (1024 * 1024);
    assert!(text.contains("MiB are free") && text.contains("delete what is not needed"), "{text}");
    assert!(text.contains(&folder.path().display().to_string()) && free > 0, "{text}");
    assert!(check_free(&folder.path().join("none"), &rig, None).is_err());
}
