use crate::effect::bench::{effect, fine, still, upon};

#[test]
fn a_deeper_point_is_spread_wider() {
    let one = fine(effect("depth-dependent-spread", [("growth_share", 0.5)]));
    for (depth_share, sigma) in [(0.2, 1.1_f64), (0.8, 1.4), (1.0, 1.5)] {
        let depth_mm = 1.016 * depth_share;
        let counts = still(&one, upon(&one, 0, depth_mm));
        for (element, r2) in [(0, 0.0), (1, 1.0), (4, 2.0), (5, 17.0)] {
            let want = depth_mm * (-0.5 * r2 / sigma.powi(2)).exp() / sigma.powi(2);
            let got = counts[element];
            assert!((got / want - 1.0).abs() < 1e-5, "{depth_share}, element {element}: {got} {want}");
        }
    }
}

#[test]
fn a_press_through_the_covering_is_as_wide_as_at_its_foot() {
    let one = fine(effect("depth-dependent-spread", [("growth_share", 0.5)]));
    let (foot, beyond) = (still(&one, upon(&one, 0, 1.016)), still(&one, upon(&one, 0, 1.5)));
    assert!(foot.iter().zip(beyond).all(|(foot, beyond)| (foot - beyond).abs() < 1e-9));
}
