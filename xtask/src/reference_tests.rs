use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::{BOOK, MANUAL, write};

#[test]
fn the_committed_reference_is_up_to_date() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let fresh = tempfile::tempdir().unwrap();
    write(&top, fresh.path()).unwrap();
    for folder in [BOOK, MANUAL] {
        let (committed, made) = (files(&top.join(folder)), files(&fresh.path().join(folder)));
        let names = |files: &BTreeMap<String, String>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&committed), names(&made), "{folder}: run `cargo xtask reference`");
        for (name, text) in &made {
            assert!(
                committed[name] == *text,
                "{folder}/{name} is out of date: run `cargo xtask reference` and commit what it writes"
            );
        }
    }
}

fn files(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, fs::read_to_string(path).unwrap())
        })
        .collect()
}
