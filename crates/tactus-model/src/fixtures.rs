//! Meshes and attitudes for tests.

use crate::Mesh;

/// A closed prism over an outline, counter-clockwise seen from above, which is cut into the given triangles. Its lower face is at z = 0.
pub(crate) fn prism(outline: &[[f64; 2]], face: &[[u32; 3]], height_mm: f64) -> Mesh {
    let count = u32::try_from(outline.len()).unwrap();
    let at = |z: f64| outline.iter().map(move |[x, y]| [*x, *y, z]);
    let walls = (0..count).flat_map(|side| {
        let next = (side + 1) % count;
        [[side, next, count + next], [side, count + next, count + side]]
    });
    let ends = face.iter().flat_map(|[a, b, c]| [[*a, *c, *b], [count + a, count + b, count + c]]);
    let vertices_mm: Vec<_> = at(0.0).chain(at(height_mm)).collect();
    Mesh::new(&vertices_mm, &walls.chain(ends).collect::<Vec<_>>()).unwrap()
}

/// A closed block, its axis in the middle of its lower face.
pub(crate) fn block([width_mm, depth_mm, height_mm]: [f64; 3]) -> Mesh {
    let [x, y] = [width_mm / 2.0, depth_mm / 2.0];
    prism(&[[-x, -y], [x, -y], [x, y], [-x, y]], &[[0, 1, 2], [0, 2, 3]], height_mm)
}

/// `R_z(yaw) R_y(pitch) R_x(roll)`, row by row.
pub(crate) fn rotation([yaw_deg, pitch_deg, roll_deg]: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sa, ca), (sb, cb), (sc, cc)] = [yaw_deg, pitch_deg, roll_deg].map(|deg| deg.to_radians().sin_cos());
    [
        [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
        [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
        [-sb, cb * sc, cb * cc],
    ]
}
