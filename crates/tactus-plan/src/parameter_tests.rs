use super::*;
use serde_json::json;

fn parameter(default: Value) -> Parameter {
    Parameter {
        name: "p".into(),
        kind: ParameterType::of(&default).unwrap(),
        default,
        doc: String::new(),
        unit: Some("mm".into()),
        choices: None,
        min: None,
        max: None,
    }
}

#[test]
fn the_type_comes_from_the_default() {
    for (default, kind) in [
        (json!(true), ParameterType::Bool),
        (json!(3), ParameterType::Int),
        (json!(3.0), ParameterType::Float),
        (json!("a"), ParameterType::String),
        (json!([1, 2]), ParameterType::ListOfInt),
        (json!([1, 2.5]), ParameterType::ListOfFloat),
    ] {
        assert_eq!(ParameterType::of(&default), Ok(kind), "{default}");
    }
    for default in [json!(null), json!([]), json!(["a"]), json!({})] {
        assert!(ParameterType::of(&default).is_err(), "{default}");
    }
}

#[test]
fn whole_numbers_become_floats_where_floats_are_wanted_and_not_the_other_way() {
    assert_eq!(parameter(json!(1.5)).accept(&json!(2)), Ok(json!(2.0)));
    assert_eq!(parameter(json!([1.5])).accept(&json!([2, 3.5])), Ok(json!([2.0, 3.5])));
    assert_eq!(parameter(json!(1)).accept(&json!(2.5)), Err("p is 2.5, not a whole number".into()));
}

#[test]
fn wrong_values_are_told_with_what_would_be_right() {
    let bounded = Parameter { min: Some(0.0), max: Some(1.0), ..parameter(json!([0.5])) };
    assert_eq!(bounded.accept(&json!([0.2, 1.5])), Err("p is 1.5 mm, the greatest is 1 mm".into()));
    assert_eq!(bounded.accept(&json!([-0.1])), Err("p is -0.1 mm, the least is 0 mm".into()));
    assert_eq!(bounded.accept(&json!([])), Err("p needs at least one value".into()));
    assert_eq!(bounded.accept(&json!(0.5)), Err("p is 0.5, not a list of numbers".into()));
    let chosen = Parameter { choices: Some(vec![json!("a"), json!("b")]), ..parameter(json!("a")) };
    assert_eq!(chosen.accept(&json!("c")), Err("p is \"c\", not one of \"a\", \"b\"".into()));
}

#[test]
fn a_text_parameter_takes_its_text_bare_or_quoted() {
    let text = parameter(json!("a"));
    assert_eq!(text.accept_text("raster"), Ok(json!("raster")));
    assert_eq!(text.accept_text("\"raster\""), Ok(json!("raster")));
    assert_eq!(text.accept_text("12"), Ok(json!("12")));
    assert_eq!(parameter(json!(1.0)).accept_text("many"), Err("p is \"many\", not a number".into()));
}

#[test]
fn a_default_outside_its_own_bounds_is_no_declaration() {
    let declared = Parameter { min: Some(1.0), ..parameter(json!(0.5)) }.declare();
    assert_eq!(declared, Err("the default of p is 0.5 mm, the least is 1 mm".into()));
    assert!(Parameter { name: "a b".into(), ..parameter(json!(1)) }.declare().is_err());
}
