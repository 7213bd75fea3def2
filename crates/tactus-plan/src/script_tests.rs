use super::*;
use tactus_schema::Rig;

const SCRIPT: &str = r#""""One line that sums it up.

  More of it.
"""

DEPTH_MM = param("depth_mm", default = 0.3, doc = "how deep", unit = "mm", min = 0.1, max = 0.7)
ORDER = param("order", default = "random", choices = ["random", "raster"])
AT = param("at", default = [1, 2])
SHARE = param("share", default = 0.5 * rig.covering_mm)

def run(rig):
    pass
"#;

fn view() -> RigView {
    RigView::of(&Rig::from_toml(include_str!("../../../config/rigs/sim.toml")).unwrap())
}

fn resolved(assignments: &[&str]) -> Result<String, String> {
    let mut arguments = Arguments::default();
    for assignment in assignments {
        arguments.set(assignment).unwrap();
    }
    let script = Script::parse("s", SCRIPT).unwrap();
    arguments.resolve(&script, &view()).map(|all| all.to_json()).map_err(|error| error.to_string())
}

#[test]
fn a_script_knows_its_name_hash_and_documentation() {
    let script = Script::parse("one.star", "def run(rig):\n    pass\n").unwrap();
    assert_eq!(script.name(), "one");
    // printf 'def run(rig):\n    pass\n' | sha256sum
    assert_eq!(script.sha256(), "cb94a2404ab5117610e8522622150759aacb2251309459bb5b96cd47b90133c3");
    assert_eq!(script.doc(), "");
    let script = Script::parse("s", SCRIPT).unwrap();
    assert_eq!(script.summary(), "One line that sums it up.");
    assert_eq!(script.doc(), "One line that sums it up.\n\n  More of it.");
}

#[test]
fn parameters_are_those_declared_and_may_depend_on_the_rig() {
    let parameters = Script::parse("s", SCRIPT).unwrap().parameters(&view()).unwrap();
    let names: Vec<_> = parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    assert_eq!(names, ["depth_mm", "order", "at", "share"]);
    assert_eq!((parameters[0].min, parameters[0].max), (Some(0.1), Some(0.7)));
    assert_eq!((parameters[0].doc.as_str(), parameters[0].unit.as_deref()), ("how deep", Some("mm")));
    assert_eq!(parameters[3].default, serde_json::json!(0.508));
    assert_eq!(
        serde_json::to_string(&parameters[2]).unwrap(),
        r#"{"name":"at","kind":"list-of-int","default":[1,2],"doc":"","unit":null,"choices":null,"min":null,"max":null}"#
    );
}

#[test]
fn resolving_fills_in_the_defaults() {
    assert_eq!(
        resolved(&["depth_mm=0.5", "at=[3]"]).unwrap(),
        r#"{"at":[3],"depth_mm":0.5,"order":"random","share":0.508}"#
    );
}

#[test]
fn resolving_refuses_with_what_exists() {
    for (assignment, problem) in [
        ("depth=0.5", "s: there is no parameter \"depth\"; there is: depth_mm, order, at, share"),
        ("depth_mm=deep", "s: depth_mm is \"deep\", not a number"),
        ("depth_mm=0.9", "s: depth_mm is 0.9 mm, the greatest is 0.7 mm"),
        ("order=up", "s: order is \"up\", not one of \"random\", \"raster\""),
        ("at=[1.5]", "s: at is 1.5, not a list of whole numbers"),
    ] {
        assert_eq!(resolved(&[assignment]), Err(problem.to_owned()));
    }
}

#[test]
fn a_script_without_run_is_none() {
    let error = Script::parse("s", "x = 1\n").unwrap_err();
    assert_eq!(error.to_string(), "s.star:1: there is no `def run(rig):`");
}

#[test]
fn a_name_that_could_be_a_path_is_refused() {
    for name in ["", "a/b", "..", "a.b", "../../x", &"x".repeat(65)] {
        assert!(
            matches!(Script::parse(name, "def run(rig):\n    pass\n"), Err(ScriptError::Malformed(_))),
            "{name}"
        );
    }
}
