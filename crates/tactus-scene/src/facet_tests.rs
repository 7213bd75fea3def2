use super::*;
use crate::Attitude;
use tactus_model::Array;

fn lattice() -> Lattice {
    Lattice::new(&Array::digitacts(), 2.7, 0.1).unwrap()
}

/// Samples of a mesh pressed all over, by row and column of cells.
fn drawn(mesh: &Mesh, attitude: Attitude, lattice: &Lattice) -> (Window, Vec<[f32; SAMPLES]>) {
    let pose = Pose { position_mm: [8.1, 5.9], attitude, depth_mm: 0.5 };
    let mut list = Vec::new();
    let window = facets(mesh, &pose, lattice, 1.0, &mut Vec::new(), &mut list);
    let mut depths_mm = vec![[0.0; SAMPLES]; window.cells[0] * window.cells[1]];
    for facet in &list {
        facet.draw(window, &mut depths_mm);
    }
    (window, depths_mm)
}

/// A flat disc of many thin triangles about a point off its middle.
fn disc(corners: u32, hub: [f64; 2]) -> Mesh {
    let rim = (0..corners).map(|k| {
        let (sin, cos) = (f64::from(k) / f64::from(corners) * std::f64::consts::TAU).sin_cos();
        [3.0 * cos, 3.0 * sin, 0.0]
    });
    let vertices: Vec<_> = std::iter::once([hub[0], hub[1], 0.0]).chain(rim).collect();
    let triangles: Vec<_> = (0..corners).map(|k| [0, 1 + k, 1 + (k + 1) % corners]).collect();
    Mesh::new(&vertices, &triangles).unwrap()
}

#[test]
fn facets_side_by_side_leave_no_sample_between_them() {
    let lattice = lattice();
    for (corners, hub, yaw_deg) in [(6, [0.0, 0.0], 0.0), (40, [0.31, -1.7], 13.0), (301, [-2.2, 0.4], 77.7)]
    {
        let (window, depths_mm) = drawn(&disc(corners, hub), Attitude::upright(yaw_deg), &lattice);
        let middle = [0, 1].map(|axis| {
            ([8.1, 5.9][axis] - lattice.axes[axis].origin_mm) / lattice.cell_mm
                - window.first[axis] as f64
                - 0.5
        });
        for (index, samples_mm) in depths_mm.iter().enumerate() {
            let [x, y] = [index % window.cells[0], index / window.cells[0]].map(|cell| cell as f64);
            let distance_mm = lattice.cell_mm * (x - middle[0]).hypot(y - middle[1]);
            if distance_mm < 2.5 {
                assert!(
                    samples_mm.iter().all(|mm| mm.total_cmp(&0.5).is_eq()),
                    "{corners} corners, cell {x}, {y}"
                );
            } else if distance_mm > 3.1 {
                assert!(
                    samples_mm.iter().all(|mm| mm.total_cmp(&0.0).is_eq()),
                    "{corners} corners, cell {x}, {y}"
                );
            }
        }
    }
}

#[test]
fn each_sample_is_on_exactly_one_side_of_an_edge() {
    let frame = WindowGrid::of(Window { first: [0, 0], cells: [100, 100] });
    for k in 0..200 {
        let at = f64::from(k);
        let [p, q] =
            [[50.0 + 40.0 * at.sin(), 50.0 + 40.0 * at.cos(), 0.0], [at / 3.0, 100.0 - at / 7.0, 0.0]];
        let [a, b, c] = frame.side(p, q);
        assert_eq!(frame.side(q, p), [-a, -b, -c - 1]);
    }
}

#[test]
fn a_disc_covers_as_many_samples_as_its_area_holds() {
    let lattice = lattice();
    for yaw_deg in [0.0, 20.0, 45.0] {
        let (_, depths_mm) = drawn(&disc(4, [0.0, 0.0]), Attitude::upright(yaw_deg), &lattice);
        let covered = depths_mm.iter().flatten().filter(|depth_mm| **depth_mm > 0.0).count();
        // A square of 18 mm2.
        let expected = 18.0 / lattice.cell_mm.powi(2) * SAMPLES as f64;
        assert!((covered as f64 - expected).abs() < 30.0, "{covered} of {expected}");
    }
}

#[test]
fn a_tool_beside_the_lattice_or_above_the_surface_has_no_facets() {
    let mesh = disc(5, [0.0, 0.0]);
    for (position_mm, depth_mm) in [([500.0, 0.0], 0.5), ([-1e300, 0.0], 0.5), ([8.0, 6.0], 0.0)] {
        let pose = Pose { position_mm, attitude: Attitude::default(), depth_mm };
        let mut list = Vec::new();
        assert_eq!(facets(&mesh, &pose, &lattice(), 1.0, &mut Vec::new(), &mut list), Window::default());
        assert!(list.is_empty());
    }
}

#[test]
fn no_tool_goes_deeper_than_the_foot() {
    let pose = Pose {
        position_mm: [8.0, 6.0],
        attitude: Attitude { pitch_deg: 20.0, ..Attitude::default() },
        depth_mm: 1e300,
    };
    let mut list = Vec::new();
    let window = facets(&disc(5, [0.0, 0.0]), &pose, &lattice(), 1.0, &mut Vec::new(), &mut list);
    let mut depths_mm = vec![[0.0; SAMPLES]; window.cells[0] * window.cells[1]];
    for facet in &list {
        facet.draw(window, &mut depths_mm);
    }
    let deepest_mm = depths_mm.iter().flatten().copied().fold(0.0, f32::max);
    assert!((deepest_mm - 1.0).abs() < 1e-6, "{deepest_mm}");
}
