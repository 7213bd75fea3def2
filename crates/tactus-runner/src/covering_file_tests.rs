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
