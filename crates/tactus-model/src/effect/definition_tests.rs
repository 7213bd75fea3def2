use super::*;

/// The names that model files use, in the order of the stages.
const CONTRACT: [&str; 26] = [
    "misregistration",
    "surface-offset",
    "surface-tilt",
    "time-lag",
    "backlash",
    "indenter-size",
    "indenter-tilt",
    "hardening",
    "heavy-tail",
    "anisotropic-spread",
    "depth-dependent-spread",
    "edge-effect",
    "relaxation",
    "hysteresis",
    "rate-stiffening",
    "imprint",
    "softening",
    "crosstalk",
    "miswired",
    "saturation",
    "baseline-drift",
    "gain-drift",
    "low-pass",
    "scan-skew",
    "periodic-interference",
    "quantisation",
];

/// The experiments, and the parts of `diagnose`.
const PARTS: [&str; 10] = [
    "corners",
    "element-centres",
    "grid-sweep",
    "drift",
    "repeats",
    "ladder",
    "rates",
    "approach",
    "tilt",
    "hold",
];

/// Parameters of the base that an effect can look like, as model files name them.
const BASE: [&str; 4] =
    ["sigma_intercept_mm", "sensitivity_counts_per_mm", "quadratic_per_mm", "noise_rms_counts"];

fn refused<const N: usize>(name: &str, parameters: [(&str, f64); N]) -> String {
    Effect::new(name, parameters).unwrap_err().to_string()
}

#[test]
fn names_are_the_contracts_in_the_order_of_the_stages() {
    let names: Vec<_> = REGISTRY.iter().map(|definition| definition.name).collect();
    assert_eq!(names, CONTRACT);
    assert!(REGISTRY.is_sorted_by_key(|definition| definition.stage()));
}

#[test]
fn a_definition_is_whole() {
    for definition in REGISTRY {
        let name = definition.name;
        assert!(!definition.summary.is_empty() && !definition.shown_by.is_empty(), "{name}");
        for parameter in definition.parameters {
            assert!(definition.check(parameter, parameter.neutral).is_ok(), "{name}: {}", parameter.name);
        }
        for part in definition.shown_by {
            assert!(PARTS.contains(part), "{name}: {part}");
        }
        // What a parameter may be a table of, the effect is a function of.
        for by in definition.parameters.iter().flat_map(|parameter| parameter.varies) {
            let covariate = match by {
                By::Depth => Covariate::Depth,
                By::X => Covariate::PlaceX,
                By::Y => Covariate::PlaceY,
                By::Time => Covariate::Time,
            };
            assert!(definition.acts_by.contains(&covariate), "{name}: {covariate:?}");
        }
        for twin in definition.near_twins {
            let is_mutual = Definition::find(twin).is_ok_and(|twin| twin.near_twins.contains(&name));
            assert!(is_mutual || BASE.contains(twin), "{name}: {twin}");
        }
    }
}

/// By a row of the table in the effect's file; numbered parameters share one.
#[test]
fn each_parameter_is_explained() {
    let unnumbered = |name: &str| name.replace(|letter: char| letter.is_ascii_digit(), "");
    for Definition { name: effect, parameters, .. } in REGISTRY {
        let file = format!("{}/src/effect/{}.rs", env!("CARGO_MANIFEST_DIR"), effect.replace('-', "_"));
        let text = std::fs::read_to_string(file).unwrap();
        for parameter in *parameters {
            let Parameter { name, neutral, kind, .. } = parameter;
            let mut rows = text.lines().filter_map(|line| line.strip_prefix("//! | `")?.split_once('`'));
            let row = rows.find(|(first, _)| unnumbered(first) == unnumbered(name));
            let (_, row) = row.unwrap_or_else(|| panic!("{effect}: {name} has no row"));
            if matches!(kind, ParameterKind::Real | ParameterKind::Given) {
                let values = format!("| {neutral} | {} | ", parameter.range_in_words());
                assert!(row.contains(&values), "{effect}: {name} is {values}");
            }
        }
    }
}

#[test]
fn a_value_out_of_its_range_is_refused() {
    for definition in REGISTRY {
        let neutral = Effect::neutral(definition);
        for Parameter { name, range: [least, most], .. } in definition.parameters {
            for value in [least - 1e-9 - 1e-9 * least.abs(), most + 1e-9 + 1e-9 * most, f64::NAN] {
                let refused = neutral.with(name, value).is_err();
                assert!(refused, "{}: {name} = {value}", definition.name);
            }
            for value in [*least, *most] {
                assert!(neutral.with(name, value).is_ok(), "{}: {name} = {value}", definition.name);
            }
        }
    }
}

#[test]
fn parameters_come_in_any_order_and_are_found_by_name() {
    let effect = Effect::new(
        "relaxation",
        [
            ("time_constant_s", 8.0),
            ("spread_ratio", 1.0),
            ("after_release", 0.0),
            ("recovery_ratio", 1.0),
            ("relaxed_share", 0.1),
        ],
    )
    .unwrap();
    assert_eq!(effect.value("relaxed_share"), Some(0.1));
    assert_eq!(effect.value("time_constant_s"), Some(8.0));
    assert_eq!(effect.value("time_constant"), None);
    let slower = effect.with("time_constant_s", 9.0).unwrap();
    assert_eq!(slower.value("time_constant_s"), Some(9.0));
    assert_ne!(slower, effect);
    assert!(effect.with("time_constant_s", 0.0).is_err() && effect.with("tau", 1.0).is_err());
}

#[test]
fn what_is_wrong_is_said() {
    assert!(refused("relaxtion", []).starts_with("no effect \"relaxtion\"; there is: misregistration, "));
    assert_eq!(refused("relaxation", [("relaxed_share", 0.1)]), "relaxation: time_constant_s is missing");
    assert_eq!(
        refused("surface-offset", [("offset_um", 3.0)]),
        "surface-offset: no parameter \"offset_um\"; there is: offset_mm"
    );
    assert_eq!(
        refused("surface-offset", [("offset_mm", f64::NAN)]),
        "surface-offset: offset_mm must lie from -2 to 2, not at NaN"
    );
    assert_eq!(
        refused("surface-offset", [("offset_mm", 0.1), ("offset_mm", 0.2)]),
        "surface-offset: offset_mm is given twice"
    );
}

#[test]
fn an_element_must_be_the_arrays() {
    let wired = |element| {
        let shares = [("answers_for", 3.0), ("own_share", 0.0), ("other_share", 1.0)];
        Effect::new("miswired", [("element", element)].into_iter().chain(shares)).unwrap()
    };
    assert_eq!(wired(47.0).fits(&Array::digitacts()), Ok(()));
    for element in [48.0, 2.5] {
        let error = wired(element).fits(&Array::digitacts()).unwrap_err().to_string();
        assert_eq!(error, format!("miswired: element must be one of the elements 0 to 47, not {element}"));
    }
    assert!(wired(1.0).names_elements() && !Effect::neutral(REGISTRY[0]).names_elements());
}
