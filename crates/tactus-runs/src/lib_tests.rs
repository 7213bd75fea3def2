use std::fs;

use super::*;

#[test]
fn notes_stand_beside_the_recording_and_a_wrong_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("recording.mcap");
    assert_eq!(notes::read(&recording).unwrap(), Notes::default());
    let written = notes::change(&recording, |notes| {
        notes.tags = vec!["good".into()];
        notes.note = "first press \"hard\"\nsecond line".into();
    });
    assert_eq!(notes::read(&recording).unwrap(), written.unwrap());
    fs::write(folder.path().join("notes.toml"), "tag = [\"x\"]\n").unwrap();
    let error = notes::read(&recording).unwrap_err().to_string();
    assert!(error.contains("notes.toml") && error.contains("tag"), "{error}");
}

#[test]
fn an_index_that_cannot_be_read_is_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    for text in ["", "{", "{\"schema\":\"tactus.runs/9\",\"recordings\":{}}"] {
        fs::write(folder.path().join(index::INDEX), text).unwrap();
        let (index, unreadable) = Index::kept(folder.path()).renewed(folder.path()).unwrap();
        assert!(index.entries().is_empty() && unreadable.is_empty());
    }
}

#[test]
fn a_recording_that_cannot_be_read_is_named_and_hides_no_other() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("broken.mcap"), "not MCAP").unwrap();
    let here = RunsFolder::new(folder.path());
    let Runs { runs, unreadable } = here.runs().unwrap();
    assert!(runs.is_empty() && unreadable[0].contains("broken.mcap"), "{unreadable:?}");
    assert!(here.find("x").unwrap_err().is_usage());
    assert!(RunsFolder::new(folder.path().join("nowhere")).runs().unwrap_err().is_usage());
}

#[test]
fn a_tag_is_one_word() {
    assert_eq!(tag("baseline-1"), Ok("baseline-1".to_owned()));
    assert!(tag("two words").is_err() && tag("").is_err());
}
