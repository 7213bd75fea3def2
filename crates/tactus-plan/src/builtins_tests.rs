use super::*;

#[test]
fn the_reference_documents_every_function() {
    let reference = reference();
    for name in globals().names() {
        let name = name.as_str();
        assert!(name == "pi" || reference.contains(&format!("def {name}(")), "{name} in {reference}");
    }
    let documented = reference.matches("\"\"\"").count() + reference.matches("r\"\"\"").count();
    assert!(documented >= 2 * (globals().names().count() - 1), "{reference}");
}
