use super::{
    Face, ObliqueView, Paint, dot,
    order::{back_to_front, normal},
};
use crate::plot::Sheet;

const GREY: Paint = Paint { rgb: [100.0; 3], opacity: 1.0 };

fn svg(faces: Vec<Face>, elevation_deg: f64) -> String {
    let view = ObliqueView { faces, azimuth_deg: -90.0, elevation_deg, px_per_mm: 10.0 };
    let mut sheet = Sheet::new("view", [100.0, 100.0]);
    sheet.put([50.0, 50.0], &view);
    sheet.to_string()
}

#[test]
fn a_box_seen_from_the_front_shows_its_front_only() {
    let faces = Face::of_box([[-1.0, 1.0], [-1.0, 1.0], [0.0, 3.0]], GREY).to_vec();
    let svg = svg(faces, 0.0);
    assert!(svg.contains(r#"d="M-10.0 -0.0L10.0 -0.0L10.0 -30.0L-10.0 -30.0Z""#), "{svg}");
    assert_eq!(svg.matches('Z').count(), 1, "{svg}");
}

#[test]
fn a_box_is_closed_and_seen_from_outside() {
    let faces = Face::of_box([[0.0, 2.0], [0.0, 3.0], [0.0, 5.0]], GREY);
    let middle = [1.0, 1.5, 2.5];
    for face in &faces {
        let outwards = [0, 1, 2].map(|axis| face.corners_mm[0][axis] - middle[axis]);
        assert!(dot(normal(face), outwards) > 0.0, "{face:?}");
    }
    let sum = faces.iter().map(normal).fold([0.0; 3], |sum, n| [0, 1, 2].map(|axis| sum[axis] + n[axis]));
    assert!(dot(sum, sum) < 1e-24);
}

#[test]
fn what_is_drawn_last_at_a_point_is_what_stands_nearest() {
    // Triangles of a fixed random walk, all seen by a viewer above; many intersect.
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    };
    let mut triangles: Vec<Face> = Vec::new();
    while triangles.len() < 40 {
        let corners_mm = (0..3).map(|_| [random(), random(), random()]).collect();
        // The colour is the triangle's number.
        let face = Face { corners_mm, paint: Paint { rgb: [triangles.len() as f64; 3], opacity: 1.0 } };
        if normal(&face)[2] > 0.05 {
            triangles.push(face);
        }
    }
    let ordered = back_to_front(triangles.clone());
    assert!(ordered.len() > triangles.len(), "some are cut");
    let mut looked = 0;
    for step in 0..2500 {
        let at = [f64::from(step % 50) / 50.0 + 0.003, f64::from(step / 50) / 50.0 + 0.007];
        let height = |face: &Face| {
            let n = normal(face);
            let corner = face.corners_mm[0];
            (dot(n, corner) - n[0] * at[0] - n[1] * at[1]) / n[2]
        };
        let mut heights: Vec<_> =
            triangles.iter().filter(|face| covers(face, at)).map(|face| (height(face), face.paint)).collect();
        heights.sort_by(|a, b| b.0.total_cmp(&a.0));
        let last = ordered.iter().rev().find(|face| covers(face, at)).map(|face| face.paint);
        // Not where two of them all but meet.
        if heights.len() < 2 || heights[0].0 - heights[1].0 > 1e-3 {
            assert_eq!(last, heights.first().map(|(_, paint)| *paint), "at {at:?}");
            looked += 1;
        }
    }
    assert!(looked > 2000);
}

/// Whether a convex face, seen from above, is over a point.
fn covers(face: &Face, [x, y]: [f64; 2]) -> bool {
    let corners = &face.corners_mm;
    let left = |a: &[f64; 3], b: &[f64; 3]| (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]) >= 0.0;
    corners.iter().zip(corners.iter().cycle().skip(1)).all(|(a, b)| left(a, b))
}

#[test]
fn faces_without_area_are_not_drawn() {
    let line = Face { corners_mm: vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], paint: GREY };
    let nothing = Face { corners_mm: vec![], paint: GREY };
    let wild = Face { corners_mm: vec![[f64::NAN; 3]; 3], paint: GREY };
    assert!(!svg(vec![line, nothing, wild], 30.0).contains("<path"));
}
