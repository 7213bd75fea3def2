//! Drawing order of faces by binary space partition.

use super::{Face, dot};

/// Points closer to a plane than this count as lying in it.
const FLAT_MM: f64 = 1e-6;

/// Orders faces that all face the viewer, so that each comes after those that it hides. Intersecting faces are cut.
///
/// The plane of the first face separates all others: those behind it cannot hide it, and it cannot hide those in front.
///
/// # Source
/// Fuchs, Kedem and Naylor, On Visible Surface Generation by A Priori Tree Structures (1980).
pub(super) fn back_to_front(faces: Vec<Face>) -> Vec<Face> {
    let mut ordered = Vec::with_capacity(faces.len());
    append(&mut ordered, faces);
    ordered
}

fn append(ordered: &mut Vec<Face>, faces: Vec<Face>) {
    let Some(first) = faces.first() else { return };
    let normal = normal(first);
    let level = dot(first.corners_mm[0], normal);
    let (mut behind, mut within, mut before) = (Vec::new(), Vec::new(), Vec::new());
    for face in faces {
        let heights: Vec<f64> = face.corners_mm.iter().map(|corner| dot(*corner, normal) - level).collect();
        let below = heights.iter().any(|height| *height < -FLAT_MM);
        let above = heights.iter().any(|height| *height > FLAT_MM);
        match (below, above) {
            (false, false) => within.push(face),
            (true, false) => behind.push(face),
            (false, true) => before.push(face),
            (true, true) => {
                behind.push(part(&face, &heights, -1.0));
                before.push(part(&face, &heights, 1.0));
            }
        }
    }
    append(ordered, behind);
    ordered.extend(within);
    append(ordered, before);
}

/// The part of a face above a plane or (sign -1) below it.
fn part(face: &Face, heights: &[f64], sign: f64) -> Face {
    let corners = &face.corners_mm;
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (here, corner) in corners.iter().enumerate() {
        let there = (here + 1) % corners.len();
        let (height, next) = (sign * heights[here], sign * heights[there]);
        if height >= 0.0 {
            kept.push(*corner);
        }
        if (height > 0.0 && next < 0.0) || (height < 0.0 && next > 0.0) {
            let share = height / (height - next);
            kept.push([0, 1, 2].map(|axis| corner[axis] + share * (corners[there][axis] - corner[axis])));
        }
    }
    Face { corners_mm: kept, paint: face.paint }
}

/// Unit normal towards the side from which the corners run counter-clockwise; zero for a face without area.
pub(super) fn normal(face: &Face) -> [f64; 3] {
    // Newell's sum, which allows collinear corners.
    let corners = &face.corners_mm;
    let mut sum = [0.0; 3];
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        for (axis, sum) in sum.iter_mut().enumerate() {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            *sum += (a[u] - b[u]) * (a[v] + b[v]);
        }
    }
    let length = dot(sum, sum).sqrt();
    if length > 0.0 { sum.map(|part| part / length) } else { sum }
}
