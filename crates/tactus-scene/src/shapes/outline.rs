//! Outlines in a plane.

/// Corners of a polygon, the last joined to the first. What it encloses is at its left hand.
pub(super) type Outline = Vec<[f64; 2]>;

/// A point at a distance from another, its direction counted from x towards y.
pub(super) fn polar([x, y]: [f64; 2], radius: f64, angle_deg: f64) -> [f64; 2] {
    // `libm` gives the same digits on every machine, and so the same files.
    let (sin, cos) = libm::sincos(angle_deg.to_radians());
    [x + radius * cos, y + radius * sin]
}

/// A part of a circle in equal steps, both ends included.
pub(super) fn arc(centre: [f64; 2], radius: f64, [from_deg, to_deg]: [f64; 2], steps: u32) -> Outline {
    let step_deg = (to_deg - from_deg) / f64::from(steps);
    (0..=steps).map(|step| polar(centre, radius, from_deg + f64::from(step) * step_deg)).collect()
}

/// Cuts a polygon into triangles, by clipping one ear after the other. `hole` may be empty; its outline has
/// the polygon at its left hand too. Corners are counted through both outlines.
pub(super) fn triangles(outer: &[[f64; 2]], hole: &[[f64; 2]]) -> Vec<[usize; 3]> {
    let corners = [outer, hole].concat();
    let mut ring = ring(outer, hole);
    let mut triangles = Vec::new();
    while let Some(ear) = (0..ring.len()).find(|place| is_ear(&corners, &ring, *place)) {
        triangles.push(corner(&ring, ear));
        ring.remove(ear);
    }
    triangles
}

/// One way around outline and hole, over a bridge between their closest corners and back.
fn ring(outer: &[[f64; 2]], hole: &[[f64; 2]]) -> Vec<usize> {
    let pairs = (0..outer.len()).flat_map(|near| (0..hole.len()).map(move |far| (near, far)));
    let span = |(near, far): (usize, usize)| {
        (outer[near][0] - hole[far][0]).powi(2) + (outer[near][1] - hole[far][1]).powi(2)
    };
    let Some((near, far)) = pairs.min_by(|a, b| span(*a).total_cmp(&span(*b))) else {
        return (0..outer.len()).collect();
    };
    let around_hole = (0..=hole.len()).map(|step| outer.len() + (far + step) % hole.len());
    (0..=near).chain(around_hole).chain(near..outer.len()).collect()
}

/// Whether the corner at a place of the ring turns left, and no other corner lies in its triangle.
fn is_ear(corners: &[[f64; 2]], ring: &[usize], place: usize) -> bool {
    let [a, b, c] = corner(ring, place).map(|at| corners[at]);
    // A bridge has its ends twice in the ring, at the same points.
    let mut others = ring.iter().map(|at| corners[*at]).filter(|point| ![a, b, c].contains(point));
    let inside = |p| twice_area(a, b, p) >= 0.0 && twice_area(b, c, p) >= 0.0 && twice_area(c, a, p) >= 0.0;
    ring.len() >= 3 && twice_area(a, b, c) > 0.0 && !others.any(inside)
}

/// A place of the ring between its neighbours.
fn corner(ring: &[usize], place: usize) -> [usize; 3] {
    [ring.len() - 1, 0, 1].map(|step| ring[(place + step) % ring.len()])
}

/// Positive if the three points turn left.
fn twice_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}
