use super::*;
use crate::effect::bench::{effect, linear, still, upon};
use crate::effect::{Make, REGISTRY};
use crate::{Effect, Moment, Pipeline};

fn table(by: By, at: &[f64], values: &[f64]) -> Table {
    Table { by, at: at.to_vec(), values: values.to_vec() }
}

/// Each parameter that may be a table, with what it may be a table of.
fn varying() -> impl Iterator<Item = (Effect, &'static Parameter, By)> {
    REGISTRY.iter().flat_map(|definition| {
        let of = definition.parameters.iter().flat_map(|one| one.varies.iter().map(move |by| (one, *by)));
        of.map(|(parameter, by)| (Effect::neutral(definition), parameter, by))
    })
}

#[test]
fn a_table_is_straight_between_its_places_and_constant_beyond() {
    let one = table(By::X, &[-1.0, 1.0, 2.0], &[3.0, 5.0, 4.0]);
    for (place, value) in
        [(-9.0, 3.0), (-1.0, 3.0), (0.0, 4.0), (1.0, 5.0), (1.5, 4.5), (2.0, 4.0), (9.0, 4.0)]
    {
        assert!((one.value(place) - value).abs() < 1e-12, "{place}: {}", one.value(place));
    }
    assert!((table(By::X, &[1.0], &[7.0]).value(0.0) - 7.0).abs() < 1e-12);
}

/// A parameter's neutral value in a table changes nothing, and another value does what it does without a table.
#[test]
fn a_table_of_one_value_is_that_value() {
    let mut seen = 0;
    for (neutral, parameter, by) in varying() {
        let value = 0.8 * parameter.neutral + 0.2 * parameter.range[1];
        let at = linear([neutral.with(parameter.name, value).unwrap()]);
        let by_table = |value| {
            linear([neutral.with_table(parameter.name, table(by, &[0.0, 1.0], &[value; 2])).unwrap()])
        };
        let tip_mm = upon(&at, 11, 0.4);
        let name = (neutral.name(), parameter.name, by.name());
        assert_eq!(still(&by_table(parameter.neutral), tip_mm), still(&linear([]), tip_mm), "{name:?}");
        assert_eq!(still(&by_table(value), tip_mm), still(&at, tip_mm), "{name:?}");
        assert_ne!(still(&at, tip_mm), still(&linear([]), tip_mm), "{name:?}");
        seen += 1;
    }
    assert!(seen > 10, "{seen} parameters may be tables");
}

/// The readings at each place and time are those of the value that the table has there; in one pipeline, which keeps what does not change.
#[test]
fn a_table_gives_each_place_its_own_value() {
    for (neutral, parameter, by) in varying() {
        let [low, high] =
            [0.05, 0.15].map(|share| parameter.neutral + share * (parameter.range[1] - parameter.neutral));
        let [from, to] = if by == By::Depth { [0.1, 0.5] } else { [2.0, 10.0] };
        let one = linear([neutral.with_table(parameter.name, table(by, &[from, to], &[low, high])).unwrap()]);
        let mut with_table = Pipeline::new(&one).unwrap();
        for share in [0.0, 0.25, 1.0] {
            let place = from + share * (to - from);
            let (mut at_mm, mut depth_mm, mut t_s) = ([8.1, 5.9], 0.3, 5.0);
            match by {
                By::Depth => depth_mm = place,
                By::X => at_mm[0] = place,
                By::Y => at_mm[1] = place,
                By::Time => t_s = place,
            }
            let [x, y] = one.registration.to_robot(at_mm);
            let tip_mm = [x, y, one.surface_mm - depth_mm];
            let value = low + share * (high - low);
            let constant = linear([neutral.with(parameter.name, value).unwrap()]);
            let got = with_table.step(Moment::at(t_s), &tip_mm);
            for (got, want) in got.iter().zip(still(&constant, tip_mm)) {
                assert!(
                    (got - want).abs() < 1e-6 * want.abs().max(1.0),
                    "{} {} by {}: {got} {want}",
                    neutral.name(),
                    parameter.name,
                    by.name()
                );
            }
        }
    }
}

#[test]
fn what_breaks_the_rules_of_a_table_is_refused() {
    let tilt = effect("indenter-tilt", [("tilt_x_deg", 1.0), ("tilt_y_deg", 0.0), ("touched_share", 0.5)]);
    let refused = |parameter: &str, one: Table| tilt.with_table(parameter, one).unwrap_err().to_string();
    let many: Vec<f64> = (0..65).map(f64::from).collect();
    for (at, values, error) in [
        (&[][..], &[][..], "must have 1 to 64 places, with as many values, not 0 and 0"),
        (&[0.1], &[1.0, 2.0], "must have 1 to 64 places, with as many values, not 1 and 2"),
        (&many, &many, "must have 1 to 64 places, with as many values, not 65 and 65"),
        (&[0.1, f64::NAN], &[1.0, 2.0], "must have finite places; at[1] is NaN"),
        (&[0.1, 0.1], &[1.0, 2.0], "must have places in order; 0.1 follows 0.1"),
        (&[0.1, 0.2], &[1.0, 11.0], "must have values from -10 to 10, not 11"),
        (&[0.1], &[f64::NAN], "must have values from -10 to 10, not NaN"),
    ] {
        let error = format!("indenter-tilt: the table of tilt_x_deg {error}");
        assert_eq!(refused("tilt_x_deg", table(By::Y, at, values)), error);
    }
    let one = || table(By::X, &[0.0], &[0.5]);
    assert_eq!(
        refused("touched_share", one()),
        "indenter-tilt: touched_share is no table of x_mm, only a value"
    );
    assert!(refused("lean", one()).starts_with("indenter-tilt: no parameter \"lean\""));
    let size = effect("indenter-size", [("ratio", 1.0)]).with_table("ratio", one()).unwrap_err().to_string();
    assert_eq!(size, "indenter-size: ratio is no table of x_mm; it may be one of depth_mm, time_s");
    let tabled = tilt.with_table("tilt_x_deg", one()).unwrap();
    assert_eq!(tabled.parameters().collect::<Vec<_>>(), [("tilt_y_deg", 0.0), ("touched_share", 0.5)]);
    assert_eq!(tabled.tables().collect::<Vec<_>>(), [("tilt_x_deg", &one())]);
    assert_eq!(
        tabled.with("tilt_x_deg", 2.0).unwrap_err().to_string(),
        "indenter-tilt: tilt_x_deg is replaced by its table; leave it out"
    );
    assert_eq!(tabled.with("tilt_y_deg", 2.0).unwrap().tables().count(), 1);
}

/// Effects with memory would forget it: a table makes their object anew at each moment.
#[test]
fn only_stages_before_the_elements_have_tables() {
    for (effect, parameter, _) in varying() {
        let before =
            matches!(effect.definition().make, Make::Motion(_) | Make::Contact(_) | Make::Covering(_));
        assert!(before && parameter.kind == crate::effect::ParameterKind::Real, "{}", effect.name());
    }
}

/// What follows time is nothing that a frame alone determines.
#[test]
fn a_table_of_time_acts_in_time_and_no_other() {
    for (neutral, parameter, by) in varying() {
        let values = [parameter.neutral; 2];
        let one = neutral.with_table(parameter.name, table(by, &[0.0, 1.0], &values)).unwrap();
        assert_eq!(one.acts_in_time(), by == By::Time, "{} by {}", neutral.name(), by.name());
    }
}

/// By the rows of the effects' pages.
#[test]
fn each_table_is_explained() {
    for (effect, parameter, _) in varying() {
        let page = effect.name().replace('-', "_");
        let page = format!("{}/src/effect/{page}.rs", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(page).unwrap();
        let row = text.lines().find(|line| line.starts_with(&format!("//! | `{}` ", parameter.name)));
        assert!(row.unwrap().contains("may be a table"), "{}: {}", effect.name(), parameter.name);
    }
}
