use super::*;

const CORNERS: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]];

#[test]
fn triangles_without_area_and_unused_vertices_are_left_out() {
    let mesh = Mesh::new(&CORNERS, &[[1, 1, 2], [0, 1, 2]]).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2]]);
    assert_eq!(mesh.bounds_mm(), [[0.0, 2.0], [0.0, 1.0], [0.0, 0.0]]);
    assert_eq!(mesh.corners_mm().collect::<Vec<_>>(), [[CORNERS[0], CORNERS[1], CORNERS[2]]]);
}

#[test]
fn what_is_no_tool_is_refused() {
    assert_eq!(Mesh::new(&CORNERS, &[]), Err(MeshError::Empty));
    assert_eq!(Mesh::new(&CORNERS, &[[0, 1, 3]]), Err(MeshError::Empty));
    let missing = MeshError::NoVertex { triangle: 0, vertex: 4, vertices: 4 };
    assert_eq!(Mesh::new(&CORNERS, &[[0, 1, 4]]), Err(missing));
    let endless = CORNERS.map(|[x, y, z]| [x, y, z / 0.0]);
    assert_eq!(Mesh::new(&endless, &[[0, 1, 2]]), Err(MeshError::NotFinite { vertex: 0 }));
    let metres = CORNERS.map(|vertex| vertex.map(|c| 1000.0 * c));
    let error = Mesh::new(&metres, &[[0, 1, 2]]).unwrap_err();
    assert_eq!(error.to_string(), "the mesh spans 2000 mm, more than 1000 mm: are its units millimetres?");
}

#[test]
fn a_turned_mesh_shows_another_side() {
    // One triangle faces down, one stands upright.
    let mesh = Mesh::new(&CORNERS, &[[0, 1, 2], [0, 1, 3]]).unwrap();
    let quarter_about_z = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(mesh.turned(quarter_about_z).unwrap().bounds_mm(), [[-1.0, 0.0], [0.0, 2.0], [0.0, 3.0]]);
    // Swapping y and z lays the upright one down.
    let lying = mesh.turned([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]).unwrap();
    assert_eq!(lying.bounds_mm(), [[0.0, 2.0], [0.0, 3.0], [0.0, 1.0]]);
    let flat = Mesh::new(&CORNERS, &[[0, 1, 2]]).unwrap();
    assert_eq!(flat.turned([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]), Err(MeshError::Empty));
}
