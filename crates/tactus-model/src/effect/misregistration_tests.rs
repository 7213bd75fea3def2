use crate::Registration;
use crate::effect::bench::{assert_slopes, effect, simulator, still, upon};

#[test]
fn a_shift_and_a_turn_are_those_of_the_registration() {
    let declared = simulator([effect(
        "misregistration",
        [("offset_x_mm", 0.3), ("offset_y_mm", -0.2), ("rotation_deg", 1.5), ("scale_error", 0.0)],
    )]);
    let mut other = simulator([]);
    other.registration = Registration { origin_mm: [20.0 + 0.3, 15.0 - 0.2], rotation_deg: 3.0 + 1.5 };
    let tip_mm = upon(&declared, 21, 0.4);
    assert_eq!(still(&declared, tip_mm), still(&other, tip_mm));
}

#[test]
fn a_stage_whose_steps_are_long_goes_further_from_the_origin() {
    let wide = simulator([effect(
        "misregistration",
        [("offset_x_mm", 0.0), ("offset_y_mm", 0.0), ("rotation_deg", 0.0), ("scale_error", 0.1)],
    )]);
    let true_one = simulator([]);
    let [x, y, z] = upon(&wide, 21, 0.4);
    let further_mm = [20.0 + 1.1 * (x - 20.0), 15.0 + 1.1 * (y - 15.0), z];
    for (got, want) in still(&wide, [x, y, z]).iter().zip(still(&true_one, further_mm)) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let names = ["offset_x_mm", "offset_y_mm", "rotation_deg", "scale_error"];
    let values = [0.2, -0.1, 2.0, 0.05];
    let all: [_; 4] = std::array::from_fn(|k| (names[k], values[k]));
    assert_slopes(&effect("misregistration", all), &names);
}
