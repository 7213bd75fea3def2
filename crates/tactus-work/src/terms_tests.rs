use serde_json::{Value, json};
use tempfile::TempDir;

use super::agree;

fn terms(arguments: Value) -> [(&'static str, Value); 2] {
    [("program", json!("1f")), ("arguments", arguments)]
}

#[test]
fn the_first_worker_sets_the_terms() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("work/terms.json");
    agree(&path, terms(json!(["--fast"]))).unwrap();
    agree(&path, terms(json!(["--fast"]))).unwrap();
    let said = agree(&path, terms(json!([]))).unwrap_err().to_string();
    assert!(said.contains(r#"are of arguments ["--fast"], not of []"#), "{said}");
}
