use crate::Registration;
use crate::effect::bench::{effect, simulator, still, upon};

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
fn a_stage_that_is_not_square_goes_along_x_as_it_goes_along_y() {
    let leaning = simulator([effect(
        "misregistration",
        [
            ("offset_x_mm", 0.0),
            ("offset_y_mm", 0.0),
            ("rotation_deg", 0.0),
            ("scale_error", 0.0),
            ("squareness_deg", 5.0),
        ],
    )]);
    let true_one = simulator([]);
    let [x, y, z] = upon(&leaning, 21, 0.4);
    let aside_mm = [x + 5.0_f64.to_radians().tan() * (y - 15.0), y, z];
    for (got, want) in still(&leaning, [x, y, z]).iter().zip(still(&true_one, aside_mm)) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn a_model_file_from_before_it_had_a_squareness_is_one_of_a_square_stage() {
    let named = [("offset_x_mm", 0.3), ("offset_y_mm", -0.2), ("rotation_deg", 1.5), ("scale_error", 0.01)];
    assert_eq!(effect("misregistration", named).value("squareness_deg"), Some(0.0));
}
