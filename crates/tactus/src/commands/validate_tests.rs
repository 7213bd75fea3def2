use super::*;

fn checked(text: &str) -> Result<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("given.toml");
    std::fs::write(&file, text).unwrap();
    check(&file).map_err(|error| format!("{error:#}"))
}

#[test]
fn a_file_is_read_as_what_its_schema_says() {
    assert_eq!(checked(SIMULATED_RIG).unwrap(), r#"rig "sim", 6 x 8 elements"#);
    let model = include_str!("../../../../config/models/digitacts.toml");
    assert_eq!(checked(model).unwrap(), r#"model of "digitacts", 6 x 8 elements, 0 effects"#);
    let slip = model.replace("rows = 6", "rows = 7");
    assert_eq!(checked(&slip).unwrap_err(), "base.array.rows: says 7, but 6 centres are listed");
}

#[test]
fn an_unknown_schema_is_named() {
    assert_eq!(
        checked("# A later one.\n  schema='tactus.model/2' # the next\n").unwrap_err(),
        r#"schema "tactus.model/2" is unknown; known are tactus.rig/1, tactus.model/1, tactus.draft/1, tactus.link/1, tactus.hidden/1"#
    );
}
