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
fn rig_files_of_a_folder_are_checked_against_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("one.toml", SIMULATED_RIG);
    let named = |name: &str| SIMULATED_RIG.replace("name = \"sim\"", &format!("name = \"{name}\""));
    write("other.toml", &named("other"));
    let all = check_all(folder.path());
    assert!(all.len() == 2 && all.iter().all(|(_, result)| result.is_ok()), "{all:?}");
    write("third.toml", SIMULATED_RIG);
    write("fourth.toml", &named("fourth").replace("rows = 6", "rows ="));
    let all = check_all(folder.path());
    let wrong: Vec<_> =
        all.iter().filter_map(|(file, result)| Some((file, result.as_ref().err()?))).collect();
    let files: Vec<_> = wrong.iter().filter_map(|(file, _)| file.file_stem()?.to_str()).collect();
    assert_eq!(files, ["fourth", "one", "third"]);
    assert!(wrong[0].1.to_string().contains("line "), "{all:?}");
    assert!(wrong[1].1.to_string().contains("third.toml have one name, \"sim\""), "{all:?}");
}

#[test]
fn an_unknown_schema_is_named() {
    assert_eq!(
        checked("# A later one.\n  schema='tactus.model/2' # the next\n").unwrap_err(),
        r#"schema "tactus.model/2" is unknown; known are tactus.rig/1, tactus.model/1, tactus.draft/1, tactus.link/1, tactus.mapping/1, tactus.hidden/1"#
    );
}
