use tempfile::TempDir;

use super::*;
use crate::commands::discover::is_name_of_draft;

#[test]
fn drafts_of_an_earlier_result_are_removed_and_nothing_else() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let others = ["draft-one.toml", "grounding.toml", "draft-1.svg", "draft-.toml", "model.toml"];
    let earlier = ["draft-1.toml", "draft-2.toml", "draft-10-refuted.toml"];
    for name in others.iter().chain(&earlier) {
        fs::write(out.join(name), "earlier").unwrap();
    }
    let new = UnfinishedFolder::create(&out).unwrap();
    for name in ["draft-2.toml", "report.json"] {
        fs::write(new.path().join(name), "new").unwrap();
    }
    new.finish(is_name_of_draft).unwrap();
    let mut left: Vec<String> =
        fs::read_dir(&out).unwrap().map(|one| one.unwrap().file_name().into_string().unwrap()).collect();
    left.sort();
    let mut want: Vec<&str> = others.into_iter().chain(["draft-2.toml", "report.json"]).collect();
    want.sort_unstable();
    assert_eq!(left, want);
    assert_eq!(fs::read_to_string(out.join("draft-2.toml")).unwrap(), "new");
}
