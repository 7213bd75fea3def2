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

/// Against the density of two correlated normals.
#[test]
fn a_slant_correlates_x_and_y() {
    for (slant, within) in [(0.05_f64, 1e-5), (-0.1, 1e-4), (0.3, 4e-3)] {
        let one = fine(effect("anisotropic-spread", [("ratio", 1.0), ("slant", slant)]));
        let density = |[x, y]: [f64; 2]| {
            let rest = 1.0 - slant * slant;
            (-0.5 * (x * x - 2.0 * slant * x * y + y * y) / rest).exp() / rest.sqrt()
        };
        let counts = still(&one, upon(&one, 4, 1.0));
        // Around the element in the middle, at 1 and 1 mm.
        for (element, at_mm) in
            [(4, [0.0, 0.0]), (0, [-1.0, -1.0]), (2, [3.0, -1.0]), (6, [-1.0, 3.0]), (3, [-1.0, 0.0])]
        {
            let (got, want) = (counts[element], density(at_mm));
            assert!((got - want).abs() < within, "{slant}, element {element}: {got} {want}");
        }
    }
}
