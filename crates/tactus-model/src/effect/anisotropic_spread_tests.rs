use crate::effect::bench::{effect, fine, still, upon};

#[test]
fn a_point_is_spread_by_a_gaussian_of_two_widths() {
    for ratio in [0.4_f64, 2.5] {
        let one = fine(effect("anisotropic-spread", [("ratio", ratio)]));
        let counts = still(&one, upon(&one, 0, 1.0));
        for (element, [x, y]) in [(0, [0.0, 0.0]), (1, [1.0, 0.0]), (3, [0.0, 1.0]), (5, [4.0, 1.0])] {
            let want = (-0.5 * (x * x / ratio + y * y * ratio)).exp();
            let got = counts[element];
            assert!((got / want - 1.0).abs() < 1e-5, "{ratio}, element {element}: {got} {want}");
        }
    }
}
