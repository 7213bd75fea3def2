use std::fs;

use tactus_schema::Rig;
use tempfile::TempDir;

use super::SensorCodec;

const RIG: &str = include_str!("../../../../config/rigs/pty-declared.toml");
const LINK: &str = include_str!("../../../../config/links/digitacts.toml");

/// Both files in folders like the shipped ones, each with one change.
fn load(rig: (&str, &str), link: (&str, &str)) -> Result<(SensorCodec, Option<String>), String> {
    let folder = TempDir::new().unwrap();
    for name in ["rigs", "links"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    assert!(RIG.contains(rig.0) && LINK.contains(link.0), "{rig:?} {link:?}");
    fs::write(folder.path().join("links/digitacts.toml"), LINK.replace(link.0, link.1)).unwrap();
    let rig_file = folder.path().join("rigs/rig.toml");
    let rig = Rig::from_toml(&RIG.replace(rig.0, rig.1)).unwrap();
    let loaded = SensorCodec::load(&rig, &rig_file).map_err(|error| error.to_string())?;
    Ok((loaded.0, loaded.1.map(|link| link.text)))
}

#[test]
fn the_description_is_found_beside_the_rig_file_and_kept() {
    let (codec, text) = load(("", ""), ("", "")).unwrap();
    let SensorCodec::Declared { format } = codec else { panic!("{codec:?}") };
    assert_eq!((format.name(), text.as_deref()), ("digitacts", Some(LINK)));
}

#[test]
fn contradictions_name_the_files_and_both_fields() {
    let element_mm = ("rows = 6\ncols = 8", "rows = 6\ncols = 8");
    for (rig, link, told) in [
        (
            ("full_scale_counts = 4095", "full_scale_counts = 70000"),
            ("", ""),
            &["samples.type is at most 65535, but array.full_scale_counts is 70000"][..],
        ),
        (
            element_mm,
            ("rows = 6\ncols = 8", "rows = 8\ncols = 6"),
            &["samples.rows and samples.cols are 8 x 6, but array.rows and array.cols are 6 x 8"],
        ),
        (
            element_mm,
            ("elements = 48\nrows = 6\ncols = 8", "elements = 40\nrows = 5\ncols = 8"),
            &["samples.elements is 40, but array.rows and array.cols are 6 x 8"],
        ),
        (
            element_mm,
            ("framing = \"stream\"", "framing = \"packet\""),
            &["framing is \"packet\"", "sensor.transport is \"serial\""],
        ),
        (element_mm, ("bytes = 106", "bytes = 50"), &["links/digitacts.toml: ", "samples.offset"]),
        (element_mm, ("bytes = 106", "byte = 106"), &["links/digitacts.toml: ", "unknown field `byte`"]),
    ] {
        let error = load(rig, link).unwrap_err();
        for part in [&["digitacts.toml"], told].concat() {
            assert!(error.contains(part), "{error}");
        }
    }
}

#[test]
fn a_file_that_is_not_there_is_told_with_the_field_that_names_it() {
    let error = load(("../links/digitacts.toml", "../links/mine.toml"), ("", "")).unwrap_err();
    assert!(
        error.contains("rig.toml: sensor.format: ") && error.contains("mine.toml cannot be read"),
        "{error}"
    );
}
