use std::{collections::BTreeMap, f64::consts::PI};

use super::*;

/// By the divergence theorem: every triangle spans a tetrahedron with the origin, of signed volume.
fn volume_mm3(surface: &Surface) -> f64 {
    let signed = |[a, b, c]: [[f64; 3]; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    surface.corners_mm().map(signed).sum::<f64>() / 6.0
}

/// Every edge has two sides, which run along it in opposite directions.
fn assert_closed(surface: &Surface) {
    let mut edges = BTreeMap::new();
    for [a, b, c] in surface.triangles() {
        for edge in [[*a, *b], [*b, *c], [*c, *a]] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    for ([a, b], count) in &edges {
        assert_eq!((*count, edges.get(&[*b, *a])), (1, Some(&1)), "edge {a} {b}");
    }
}

fn assert_near(value: f64, truth: f64, tolerance: f64) {
    assert!((value - truth).abs() <= tolerance * truth.abs(), "{value} is not {truth}");
}

/// Area that an outline encloses, by trapezes below its edges.
fn area_mm2(outline: &[[f64; 2]]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(a, b)| (a[0] - b[0]) * (a[1] + b[1]) / 2.0).sum()
}

#[test]
fn every_tool_is_closed_and_stands_at_its_place() {
    for scene in SCENES {
        let surface = scene.surface();
        assert_closed(&surface);
        assert!(volume_mm3(&surface) > 0.0, "{scene:?} is inside out");
        let [[left, right], [front, back], [bottom, _]] = scene.mesh().bounds_mm();
        assert!(bottom == 0.0, "{scene:?}");
        assert!((left + right).abs() < 1e-6 && (front + back).abs() < 1e-6, "{scene:?}");
    }
}

#[test]
fn every_tool_has_its_size() {
    let sizes_mm = SCENES.map(|scene| scene.mesh().bounds_mm().map(|[least, most]| most - least));
    let expected = [[8.0, 10.0, 10.0], [6.4, 15.0, 2.0], [10.0, 13.9, 3.2]];
    for (size, expected) in sizes_mm.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((size - expected).abs() < 0.1, "{sizes_mm:?}");
    }
}

#[test]
fn the_letter_is_two_strokes_and_a_bar() {
    let h = h();
    assert_near(volume_mm3(&h), 10.0 * (2.0 * 2.0 * 10.0 + 4.0 * 2.0), 1e-12);
    let of_strokes = [-4.0, -2.0, 2.0, 4.0].into_iter().flat_map(|x| [[x, -5.0], [x, 5.0]]);
    let of_bar = [-2.0, 2.0].into_iter().flat_map(|x| [[x, -1.0], [x, 1.0]]);
    let corners: Vec<_> = of_strokes.chain(of_bar).flat_map(|[x, y]| [[x, y, 0.0], [x, y, 10.0]]).collect();
    assert_eq!(h.vertices_mm().len(), corners.len());
    assert!(corners.iter().all(|corner| h.vertices_mm().contains(corner)));
}

#[test]
fn a_prism_has_its_outline_less_its_hole_times_its_height() {
    let outer = arc([1.0, -2.0], 5.0, [0.0, 330.0], 11);
    let hole = arc([2.0, -1.0], 1.5, [330.0, 30.0], 5);
    let prism = extrude(&outer, &hole, [-1.0, 2.5]);
    assert_closed(&prism);
    let hexagon_mm2 = 1.5 * 3.0_f64.sqrt() * 1.5 * 1.5;
    assert_near(volume_mm3(&prism), 3.5 * (area_mm2(&outer) - hexagon_mm2), 1e-12);
}

#[test]
fn a_prism_may_have_any_outline() {
    let comb = vec![
        [0.0, 0.0],
        [7.0, 0.0],
        [7.0, 4.0],
        [6.0, 4.0],
        [5.0, 1.0],
        [4.0, 4.0],
        [3.0, 4.0],
        [2.0, 1.0],
        [1.0, 4.0],
        [0.0, 4.0],
    ];
    let prism = extrude(&comb, &[], [0.0, 1.0]);
    assert_closed(&prism);
    assert_near(volume_mm3(&prism), area_mm2(&comb), 1e-12);
}

#[test]
fn a_solid_of_revolution_is_a_pile_of_frusta() {
    let profile = [[0.0, -1.0], [2.0, -1.5], [3.0, 0.0], [3.0, 2.0], [0.0, 4.0]];
    let surface = revolve(&profile, 7);
    assert_closed(&surface);
    let heptagon = |radius: f64| 3.5 * radius * radius * (2.0 * PI / 7.0).sin();
    let frusta_mm3 = profile.windows(2).map(|pair| {
        let [a, b] = [heptagon(pair[0][0]), heptagon(pair[1][0])];
        (pair[1][1] - pair[0][1]) / 3.0 * (a + b + (a * b).sqrt())
    });
    assert_near(volume_mm3(&surface), frusta_mm3.sum(), 1e-12);
}

#[test]
fn an_ellipsoid_fills_nearly_that_of_the_formula() {
    let surface = ellipsoid([1.0, 2.0, 0.5]);
    assert_closed(&surface);
    let volume = volume_mm3(&surface) / (4.0 / 3.0 * PI);
    assert!((0.95..1.0).contains(&volume), "{volume}");
}

#[test]
fn the_starship_is_seen_in_relief() {
    let triangles = spaceship().triangles().len();
    assert!((300..=2000).contains(&triangles), "{triangles} triangles");
    // Down to the plane reach the keel, less far the engines, the hull and the wings.
    let lowest_mm = |[left, right]: [f64; 2], [front, back]: [f64; 2]| {
        let ship = spaceship();
        let within = ship
            .vertices_mm()
            .iter()
            .filter(|[x, y, _]| (left..right).contains(x) && (front..back).contains(y));
        within.map(|vertex| vertex[2]).fold(f64::INFINITY, f64::min)
    };
    let keel_mm = lowest_mm([-0.5, 0.5], [-3.0, 1.0]);
    let engine_mm = lowest_mm([3.4, 5.0], [-6.0, 0.0]);
    let hull_mm = lowest_mm([-0.5, 0.5], [1.9, 5.0]);
    assert!(keel_mm == 0.0 && engine_mm > 0.1 && hull_mm > engine_mm && hull_mm < 1.0);
}

#[test]
fn a_scene_is_found_by_its_name() {
    assert_eq!(SCENES.map(|scene| Scene::named(scene.name())), SCENES.map(Some));
    assert_eq!(Scene::named("H"), None);
}
