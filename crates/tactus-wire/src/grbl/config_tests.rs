#![expect(clippy::float_cmp, reason = "sums of numbers that are exact in binary")]

use super::*;

/// x is the controller's y, counted backwards from 100; z is 5 higher there.
fn crossed() -> Config {
    let plain = Config::aligned(0.005);
    let [x, y, z] = plain.axes;
    Config {
        axes: [
            Axis { machine: AxisName::Y, direction: Direction::Negative, origin_mm: 100.0, ..x },
            Axis { machine: AxisName::X, ..y },
            Axis { origin_mm: 5.0, ..z },
        ],
        ..plain
    }
}

#[test]
fn places_go_there_and_back() {
    assert_eq!(crossed().to_machine([1.0, 2.0, -0.5]), [2.0, 99.0, 4.5]);
    assert_eq!(crossed().to_stage([2.0, 99.0, 4.5]), [1.0, 2.0, -0.5]);
    let aligned = Config::aligned(0.005);
    assert_eq!(aligned.to_stage(aligned.to_machine([1.0, 2.0, -0.5])), [1.0, 2.0, -0.5]);
    assert!(crossed().to_stage([0.0, 100.0, 5.0])[0].is_sign_positive(), "no negative zero");
}

#[test]
fn what_makes_no_stage_is_told() {
    let refusal = |config: Config| config.check().unwrap_err().to_string();
    assert_eq!(crossed().check(), Ok(()));
    assert_eq!(refusal(Config::aligned(0.0)), "tolerance_mm is 0, but must be more than 0");
    let with = |axis: fn(&mut Axis)| {
        let mut config = crossed();
        axis(&mut config.axes[1]);
        refusal(config)
    };
    assert_eq!(with(|y| y.machine = AxisName::Z), "y and z are the same axis of the controller");
    assert_eq!(with(|y| y.machine = AxisName::Y), "x and y are the same axis of the controller");
    assert_eq!(with(|y| y.steps_per_mm = Some(-1.0)), "steps_per_mm is -1, but must be more than 0");
    assert_eq!(with(|y| y.origin_mm = f64::NAN), "y: origin_mm is NaN, but must be a number");
}
