use std::{fs, path::Path};

use super::{DESCRIPTORS, RUST_TYPES, compile};

#[test]
fn the_committed_messages_are_up_to_date() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let fresh = tempfile::tempdir().unwrap();
    compile(&top, fresh.path()).unwrap();
    for path in [RUST_TYPES].into_iter().chain(DESCRIPTORS) {
        let committed = fs::read(top.join(path)).unwrap_or_default();
        let compiled = fs::read(fresh.path().join(path)).unwrap();
        assert!(
            committed == compiled,
            "{path} is out of date: run `cargo xtask proto` and commit what it writes"
        );
    }
}
