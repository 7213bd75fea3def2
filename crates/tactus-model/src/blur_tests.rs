use super::*;

const SIDE_MM: [f64; 2] = [-0.9, 0.9];

#[test]
fn a_point_at_the_middle_and_at_either_edge_has_the_tabulated_share() {
    let blur = Blur { sigma_mm: 0.9 };
    // Phi(1) and Phi(2), Abramowitz and Stegun, table 26.1.
    let (phi_1, phi_2) = (0.841_344_746_068_543, 0.977_249_868_051_821);
    for (at_mm, want) in [
        (0.0, 2.0 * phi_1 - 1.0),
        (0.9, phi_2 - 0.5),
        (-0.9, phi_2 - 0.5),
        (1.8, 1.0 - phi_1 - 0.001_349_898_031_630),
    ] {
        let got = blur.of_point(at_mm, SIDE_MM);
        assert!((got - want).abs() < 1e-14, "{at_mm}: {got} {want}");
    }
}

#[test]
fn far_away_the_share_keeps_its_relative_accuracy() {
    // 1 - Phi(8) = 6.220960574271785e-16 and 1 - Phi(10) = 7.619853024160527e-24 (same handbook, table 26.2).
    let want = 6.220_960_574_271_785e-16 - 7.619_853_024_160_527e-24;
    for at_mm in [8.1, -8.1] {
        let got = Blur { sigma_mm: 0.9 }.of_point(at_mm, SIDE_MM);
        assert!((got / want - 1.0).abs() < 1e-12, "{got} {want}");
    }
}

#[test]
fn a_line_is_the_sum_of_its_points() {
    for sigma_mm in [0.1, 0.9, 3.0] {
        let blur = Blur { sigma_mm };
        for (from, to) in [(-0.5, 0.5), (0.2, 2.0), (-3.0, -2.5), (-4.0, 4.0), (0.9, 0.9)] {
            // Midpoints of 20,000 pieces: good to about 1e-8 of the length.
            let step = (to - from) / 20_000.0;
            let want: f64 =
                (0..20_000).map(|k| step * blur.of_point(from + step * (f64::from(k) + 0.5), SIDE_MM)).sum();
            let got = blur.of_line([from, to], SIDE_MM);
            assert!((got - want).abs() < 1e-7, "{sigma_mm} {from} {to}: {got} {want}");
        }
    }
}

#[test]
fn without_blur_the_line_arrives_where_it_lies() {
    let blur = Blur { sigma_mm: 1e-9 };
    assert!((blur.of_line([0.4, 2.0], SIDE_MM) - 0.5).abs() < 1e-9);
    assert!(blur.of_line([1.0, 2.0], SIDE_MM).abs() < 1e-15);
    assert!((blur.of_point(0.5, SIDE_MM) - 1.0).abs() < 1e-15);
    assert!(blur.of_point(1.0, SIDE_MM).abs() < 1e-15);
}

#[test]
fn the_moment_of_a_line_is_the_sum_of_its_points_moments() {
    for sigma_mm in [0.1, 0.9, 3.0] {
        let blur = Blur { sigma_mm };
        for (from, to) in [(-0.5, 0.5), (0.2, 2.0), (-3.0, -2.5), (-4.0, 4.0), (1.5, 2.5), (0.9, 0.9)] {
            let step = (to - from) / 20_000.0;
            let places = (0..20_000).map(|k| from + step * (f64::from(k) + 0.5));
            let want: f64 = places.map(|y| step * y * blur.of_point(y, [-0.9, 0.9])).sum();
            let got = blur.moment_of_line([from, to], [-0.9, 0.9]);
            assert!((got - want).abs() < 1e-7, "{sigma_mm} {from} {to}: {got} {want}");
        }
    }
}
