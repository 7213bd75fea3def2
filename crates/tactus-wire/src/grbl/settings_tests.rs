use super::*;
use crate::grbl::Axis;
use crate::stage::{AxisName, Direction};

fn settings(lines: &[(u16, &str)]) -> Settings {
    let mut settings = Settings::default();
    for (number, value) in lines {
        settings.take(*number, (*value).to_owned());
    }
    settings
}

/// z is the controller's x, of 250 steps/mm.
fn config() -> Config {
    let mut config = Config::aligned(0.005);
    config.axes[2] = Axis {
        machine: AxisName::X,
        direction: Direction::Positive,
        origin_mm: 0.0,
        steps_per_mm: Some(250.0),
        home: Some(Direction::Positive),
    };
    config.axes[0].machine = AxisName::Z;
    config
}

#[test]
fn a_controller_that_is_the_rigs_is_taken() {
    assert_eq!(settings(&[(20, "1"), (22, "1"), (23, "6"), (100, "250.000")]).check(&config()), Ok(()));
    // grblHAL has more bits there.
    assert_eq!(settings(&[(20, "1"), (22, "13"), (23, "0"), (100, "250.0002")]).check(&config()), Ok(()));
    let without = Config { needs_soft_limits: false, ..config() };
    assert_eq!(settings(&[(20, "0"), (22, "1"), (23, "2"), (100, "250.000")]).check(&without), Ok(()));
}

#[test]
fn another_one_is_refused_with_both_values() {
    for (lines, refusal) in [
        (
            [(20, "1"), (22, "1"), (23, "0"), (100, "80.000")],
            "the controller has $100 = 80.000, but the rig needs 250 steps/mm of its x for the rig's z",
        ),
        ([(20, "0"), (22, "1"), (23, "0"), (100, "250.000")], "$20 = 0, but the rig needs 1, soft limits on"),
        ([(20, "1"), (22, "12"), (23, "0"), (100, "250.000")], "$22 = 12, but the rig needs 1, homing on"),
        ([(20, "1"), (21, "1"), (23, "0"), (100, "250.000")], "$22 = no such setting"),
        ([(20, "1"), (22, "on"), (23, "0"), (100, "250.000")], "$22 = on"),
        (
            [(20, "1"), (22, "1"), (23, "1"), (100, "250.000")],
            "$23 = 1, but the rig needs 1 clear in it, so that homing takes the rig's z to its high end",
        ),
        ([(20, "1"), (22, "1"), (24, "1"), (100, "250.000")], "$23 = no such setting"),
    ] {
        let error = settings(&lines).check(&config()).unwrap_err().to_string();
        assert!(error.contains(refusal), "{error}");
        assert!(error.contains("nothing was changed"), "{error}");
    }
}

#[test]
fn homing_must_go_to_the_rigs_end_whichever_way_the_controller_counts() {
    let mut turned = config();
    turned.axes[2].direction = Direction::Negative;
    turned.axes[1].home = Some(Direction::Negative);
    let check = |mask| settings(&[(20, "1"), (22, "1"), (23, mask), (100, "250.000")]).check(&turned);
    assert_eq!(check("3"), Ok(()));
    assert!(check("2").unwrap_err().to_string().contains("1 set in it"));
    assert!(check("1").unwrap_err().to_string().contains("the rig's y to its low end"));
}

#[test]
fn what_matters_to_a_stage_is_told() {
    let told = settings(&[(0, "10"), (20, "1"), (101, "80.000"), (132, "200.000")]).list();
    let told: Vec<_> =
        told.iter().map(|one| format!("{} = {}, {}", one.name, one.value, one.meaning)).collect();
    let want = [
        "$20 = 1, soft limits",
        "$101 = 80.000, steps/mm of the controller's y",
        "$132 = 200.000, travel, mm, of the controller's z",
    ];
    assert_eq!(told, want);
}
