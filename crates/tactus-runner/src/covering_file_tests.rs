use super::*;

#[test]
fn a_thickness_is_kept_and_a_damaged_file_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = CoveringFile::of("lab", &folder.path().join("runs"));
    assert_eq!(file.recall().unwrap(), None);
    for thickness_mm in [2.54, 1.016] {
        file.remember(thickness_mm).unwrap();
        assert_eq!(file.recall().unwrap(), Some(thickness_mm));
    }
    for damaged in ["", "thickness_mm = 2.54", "schema = \"tactus.covering/1\"\nthickness_mm = -1.0\n"] {
        fs::write(folder.path().join("runs/lab.covering.toml"), damaged).unwrap();
        let error = file.recall().unwrap_err();
        assert!(error.to_string().contains("lab.covering.toml"), "{error}");
    }
}

#[test]
fn a_covering_is_kept_although_the_folder_of_recordings_is_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let (state, runs) = (folder.path().join("state"), folder.path().join("runs"));
    CoveringFile::of("lab", &runs).with_copy(Some(&state)).remember(1.016).unwrap();
    fs::rename(&runs, folder.path().join("runs-2026")).unwrap();
    for recordings in [runs, folder.path().join("elsewhere")] {
        let file = CoveringFile::of("lab", &recordings).with_copy(Some(&state));
        assert_eq!(file.recall().unwrap(), Some(1.016));
    }
}

#[test]
fn a_covering_without_a_copy_is_copied_and_of_two_the_thinner_counts() {
    let folder = tempfile::tempdir().unwrap();
    let (state, runs) = (folder.path().join("state"), folder.path().join("runs"));
    CoveringFile::of("lab", &runs).remember(1.016).unwrap();
    let file = CoveringFile::of("lab", &runs).with_copy(Some(&state));
    assert_eq!(file.recall().unwrap(), Some(1.016));
    fs::remove_dir_all(&runs).unwrap();
    assert_eq!(file.recall().unwrap(), Some(1.016));
    for (own_mm, copy_mm) in [(3.0, 1.016), (1.016, 3.0)] {
        CoveringFile::of("lab", &runs).remember(own_mm).unwrap();
        CoveringFile::of("lab", &state).remember(copy_mm).unwrap();
        assert_eq!(file.recall().unwrap(), Some(1.016));
    }
    fs::write(state.join("lab.covering.toml"), "").unwrap();
    assert!(file.recall().is_err(), "a damaged file is not replaced by the other one");
}

#[test]
fn a_state_directory_that_cannot_be_written_costs_the_copy_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (state, runs) = (folder.path().join("state"), folder.path().join("runs"));
    fs::write(&state, "no folder").unwrap();
    let file = CoveringFile::of("lab", &runs).with_copy(Some(&state.join("coverings")));
    for thickness_mm in [1.016, 2.54] {
        file.remember(thickness_mm).unwrap();
        assert_eq!(file.recall().unwrap(), Some(thickness_mm));
    }
}
