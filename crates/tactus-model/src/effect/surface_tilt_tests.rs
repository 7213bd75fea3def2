use crate::Effect;
use crate::effect::bench::{effect, simulator, still, upon};

fn sloping(slope: [f64; 2], touched_mm: [f64; 2]) -> Effect {
    let names = ["slope_x_mm_per_mm", "slope_y_mm_per_mm", "touched_x_mm", "touched_y_mm"];
    let values = [slope[0], slope[1], touched_mm[0], touched_mm[1]];
    effect("surface-tilt", std::array::from_fn::<_, 4, _>(|k| (names[k], values[k])))
}

#[test]
fn depth_changes_in_proportion_to_the_distance_from_where_the_surface_was_touched() {
    let sloping = simulator([sloping([0.01, -0.02], [1.0, 0.5])]);
    // Column 5 and row 4 stand at 11.1 and 8.9 mm, the middle at 8.1 and 5.9 mm.
    let rise_mm = 0.01 * (11.1 - 8.1 - 1.0) - 0.02 * (8.9 - 5.9 - 0.5);
    let (got, want) =
        (still(&sloping, upon(&sloping, 37, 0.4)), still(&simulator([]), upon(&sloping, 37, 0.4 + rise_mm)));
    for (got, want) in got.iter().zip(want) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
}
