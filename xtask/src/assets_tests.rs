use std::{fs, path::Path};

use super::{FOLDER, write};
use tactus_scene::shapes::SCENES;

#[test]
fn the_committed_tools_are_up_to_date() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let fresh = tempfile::tempdir().unwrap();
    write(fresh.path()).unwrap();
    for scene in SCENES {
        let path = format!("{FOLDER}/{}.stl", scene.name());
        let committed = fs::read(top.join(&path)).unwrap_or_default();
        let made = fs::read(fresh.path().join(&path)).unwrap();
        assert!(
            committed == made,
            "{path} is out of date: run `cargo xtask assets` and commit what it writes"
        );
    }
}
