use super::*;

#[test]
fn assignments_and_json_say_the_same() {
    let mut typed = Arguments::default();
    typed.set("depths_mm = [0.2, 0.3]").unwrap();
    typed.set("order=raster").unwrap();
    assert_eq!(typed.to_json(), r#"{"depths_mm":[0.2,0.3],"order":"raster"}"#);
    assert_eq!(Arguments::from_json(&typed.to_json()).unwrap().to_json(), typed.to_json());
}

#[test]
fn a_later_assignment_replaces_the_earlier() {
    let mut arguments = Arguments::default();
    arguments.set("n=1").unwrap();
    arguments.set("n=2").unwrap();
    assert_eq!(arguments.to_json(), r#"{"n":2}"#);
}

#[test]
fn what_cannot_be_read_is_refused() {
    assert!(Arguments::from_json("[1]").is_err());
    assert!(Arguments::from_json("{\"a\": }").unwrap_err().to_string().contains("column"));
    assert!(Arguments::default().set("depth").unwrap_err().to_string().contains("name=value"));
    assert!(Arguments::default().set("=3").is_err());
    assert!(Arguments::from_json("  ").unwrap().is_empty());
}
