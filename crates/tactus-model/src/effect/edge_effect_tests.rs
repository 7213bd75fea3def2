use crate::Effect;
use crate::effect::bench::{effect, linear, still};

fn edge(edge_share: f64, seam_share: f64, reach_mm: f64) -> Effect {
    effect("edge-effect", [("edge_share", edge_share), ("seam_share", seam_share), ("reach_mm", reach_mm)])
}

#[test]
fn all_elements_gain_by_the_tools_distance_from_edge_and_seam() {
    let (with, without) = (linear([edge(-0.3, 0.2, 1.5)]), linear([]));
    // The active area reaches from 0 to 16.2 and from 0 to 11.8 mm.
    for (at_mm, edge_mm, seam_mm) in [
        ([8.1, 5.9], 5.9, 0.0),
        ([2.0, 6.0], 2.0, 6.1),
        ([15.7, 6.0], 0.5, 7.6),
        ([6.0, 0.4], 0.4, 2.1),
        ([9.0, 11.0], 0.8, 0.9),
        ([-1.0, 5.0], 0.0, 9.1),
    ] {
        let [x, y] = with.registration.to_robot(at_mm);
        let tip_mm = [x, y, with.surface_mm - 0.4];
        let want = 1.0 - 0.3 * f64::exp(-edge_mm / 1.5) + 0.2 * f64::exp(-seam_mm / 1.5);
        for (with, without) in still(&with, tip_mm).iter().zip(still(&without, tip_mm)) {
            assert!((with / without - want).abs() < 1e-9, "at {at_mm:?}: {} {want}", with / without);
        }
    }
}

#[test]
fn each_side_and_the_corners_have_shares_of_their_own() {
    let without = linear([]);
    let at_mm = [14.0, 1.5];
    let [x, y] = without.registration.to_robot(at_mm);
    let tip_mm = [x, y, without.surface_mm - 0.4];
    for (parameter, distance_mm) in [
        ("x_min_share", 14.0),
        ("x_max_share", 2.2),
        ("y_min_share", 1.5),
        ("y_max_share", 10.3),
        ("corner_share", 2.2 + 1.5),
    ] {
        let with = linear([edge(0.0, 0.0, 1.5).with(parameter, -0.4).unwrap()]);
        let want = 1.0 - 0.4 * f64::exp(-distance_mm / 1.5);
        for (with, without) in still(&with, tip_mm).iter().zip(still(&without, tip_mm)) {
            assert!((with / without - want).abs() < 1e-9, "{parameter}: {} {want}", with / without);
        }
    }
}
