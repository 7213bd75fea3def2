use crate::effect::bench::{assert_slopes, effect, simulator, still, upon};

#[test]
fn depth_changes_in_proportion_to_the_distance_from_the_middle() {
    let sloping =
        simulator([effect("surface-tilt", [("slope_x_mm_per_mm", 0.01), ("slope_y_mm_per_mm", -0.02)])]);
    // Column 5 and row 4 stand at 11.1 and 8.9 mm, the middle at 8.1 and 5.9 mm.
    let rise_mm = 0.01 * (11.1 - 8.1) - 0.02 * (8.9 - 5.9);
    let (got, want) =
        (still(&sloping, upon(&sloping, 37, 0.4)), still(&simulator([]), upon(&sloping, 37, 0.4 + rise_mm)));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    let names = ["slope_x_mm_per_mm", "slope_y_mm_per_mm"];
    assert_slopes(&effect("surface-tilt", [(names[0], 0.02), (names[1], -0.01)]), &names);
}
