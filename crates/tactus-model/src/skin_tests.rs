use super::*;

/// Corners of a box, the lower four first, counter-clockwise seen from above.
fn corners([x, y, z]: [f64; 3], [width, depth, height]: [f64; 3]) -> Vec<[f64; 3]> {
    [0.0, 1.0]
        .iter()
        .flat_map(|up| {
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|[right, back]| [x + width * right, y + depth * back, z + height * up])
        })
        .collect()
}

/// Triangles of a box, counter-clockwise seen from outside.
const BOX: [[u32; 3]; 12] = [
    [0, 2, 1],
    [0, 3, 2],
    [4, 5, 6],
    [4, 6, 7],
    [0, 1, 5],
    [0, 5, 4],
    [1, 2, 6],
    [1, 6, 5],
    [2, 3, 7],
    [2, 7, 6],
    [3, 0, 4],
    [3, 4, 7],
];

/// Several boxes in one mesh, each by its place and size.
fn boxes(boxes: &[([f64; 3], [f64; 3])]) -> Mesh {
    let vertices_mm: Vec<_> = boxes.iter().flat_map(|(place, size)| corners(*place, *size)).collect();
    let triangles =
        (0_u32..).zip(boxes).flat_map(|(of, _)| BOX.map(|corners| corners.map(|corner| 8 * of + corner)));
    Mesh::new(&vertices_mm, &triangles.collect::<Vec<_>>()).unwrap()
}

fn volume_mm3(skin: &Skin) -> f64 {
    (0..skin.triangles.len()).map(|triangle| skin.six_volumes_mm3(triangle)).sum::<f64>() / 6.0
}

#[test]
fn a_box_is_a_skin_whatever_the_order_of_its_corners() {
    let vertices_mm = corners([1.0, -2.0, 3.0], [2.0, 3.0, 4.0]);
    for turned in 0..1 << BOX.len() {
        // Some of the many ways to turn triangles.
        if turned % 97 != 0 {
            continue;
        }
        let mut triangles = BOX;
        for (place, triangle) in triangles.iter_mut().enumerate() {
            if turned >> place & 1 == 1 {
                triangle.swap(0, 2);
            }
        }
        let skin = Skin::of(&Mesh::new(&vertices_mm, &triangles).unwrap()).unwrap();
        assert!((volume_mm3(&skin) - 24.0).abs() < 1e-12);
        assert_eq!(skin.seams.len(), 18);
        for Seam { ends: [from, to], beside: [one, other] } in &skin.seams {
            assert!(has(skin.triangles[*one as usize], [*from, *to]));
            assert!(has(skin.triangles[*other as usize], [*to, *from]));
        }
    }
}

#[test]
fn corners_at_one_place_are_one() {
    // As in an STL file that was read triangle by triangle.
    let vertices_mm = corners([0.0; 3], [1.0; 3]);
    let apart: Vec<_> = BOX.iter().flatten().map(|corner| vertices_mm[*corner as usize]).collect();
    let triangles: Vec<_> =
        (0..12).map(|triangle| [3 * triangle, 3 * triangle + 1, 3 * triangle + 2]).collect();
    let skin = Skin::of(&Mesh::new(&apart, &triangles).unwrap()).unwrap();
    assert_eq!(skin.points_mm.len(), 8);
}

#[test]
fn an_open_mesh_is_no_skin() {
    let vertices_mm = corners([0.0; 3], [1.0; 3]);
    assert!(Skin::of(&Mesh::new(&vertices_mm, &BOX[..11]).unwrap()).is_none());
    // A third triangle at an edge.
    let fin = [&BOX[..], &[[0, 6, 1]]].concat();
    assert!(Skin::of(&Mesh::new(&vertices_mm, &fin).unwrap()).is_none());
}

#[test]
fn solids_side_by_side_are_a_skin_and_those_that_meet_are_none() {
    let first = ([0.0; 3], [2.0, 2.0, 2.0]);
    let beside = |place: [f64; 3], size: [f64; 3]| Skin::of(&boxes(&[first, (place, size)])).is_some();
    assert!(beside([2.5, 0.0, 0.0], [1.0; 3]), "apart");
    assert!(!beside([1.0, 0.5, 0.5], [2.0, 1.0, 1.0]), "one edge runs through a face");
    assert!(!beside([1.0, 1.0, 0.0], [2.0, 2.0, 2.0]), "lower faces in one plane");
    assert!(!beside([-1.0, 0.5, 0.0], [4.0, 1.0, 2.0]), "a cross");
    assert!(!beside([2.0, 0.0, 0.0], [2.0, 2.0, 2.0]), "a face in common");
    assert!(!beside([0.5; 3], [1.0; 3]), "one within the other");
}

#[test]
fn a_surface_folded_onto_itself_is_no_skin() {
    // A tetrahedron whose fourth corner lies in the plane of the others has no volume.
    let flat = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5, 0.5, 0.0]];
    let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    assert!(Skin::of(&Mesh::new(&flat, &triangles).unwrap()).is_none());
    let mut raised = flat;
    raised[3][2] = 1.0;
    assert!(Skin::of(&Mesh::new(&raised, &triangles).unwrap()).is_some());
}

#[test]
fn a_fine_sphere_is_a_skin() {
    let (rings, sides) = (24_u32, 48_u32);
    let mut vertices_mm = vec![[0.0, 0.0, -2.0], [0.0, 0.0, 2.0]];
    for ring in 1..rings {
        let (sin, cos) = (std::f64::consts::PI * f64::from(ring) / f64::from(rings)).sin_cos();
        for side in 0..sides {
            let (y, x) = (std::f64::consts::TAU * f64::from(side) / f64::from(sides)).sin_cos();
            vertices_mm.push([2.0 * sin * x, 2.0 * sin * y, -2.0 * cos]);
        }
    }
    let at = |ring: u32, side: u32| match ring {
        0 => 0,
        ring if ring == rings => 1,
        ring => 2 + (ring - 1) * sides + side % sides,
    };
    let triangles: Vec<_> = (0..rings)
        .flat_map(|ring| {
            (0..sides).flat_map(move |side| {
                let corners =
                    [at(ring, side), at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)];
                let [a, b, c, d] = corners;
                [(ring > 0).then_some([a, b, d]), (ring + 1 < rings).then_some([a, d, c])]
            })
        })
        .flatten()
        .collect();
    let skin = Skin::of(&Mesh::new(&vertices_mm, &triangles).unwrap()).unwrap();
    let sphere = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
    assert!((volume_mm3(&skin) / sphere - 1.0).abs() < 0.01, "{}", volume_mm3(&skin));
}
