use super::*;

#[test]
fn points_stand_apart_and_no_share_is_rounded_up() {
    let form =
        |physics, is_library_point, shrink| Form { physics, effect: "backlash", is_library_point, shrink };
    let text = forms_table(&[form("one", true, 1.0), form("two", false, 0.9996), form("three", false, 0.5)]);
    assert!(text.ends_with("| backlash | one 1.000 | two 0.999, three 0.500 |\n"), "{text}");
}
