//! The outline of what a mesh presses: its image as integrals along edges.

use super::mesh::below_surface;
use super::{Contact, Cut};
use crate::Indenter;
use crate::quadrature::smooth;
use crate::skin::{Seam, Skin, turn};

/// A straight part of the border of what is pressed, or of the border between two faces. Sensor frame; what is pressed, or the
/// first face, is at its left hand, seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    /// Its ends: x, y and depth below the surface, all in mm.
    pub(crate) ends_mm: [[f64; 3]; 2],
    /// 1 where it is a border of what is pressed, 0 between two faces, -1 around a part that is taken off.
    pub(crate) rim: f64,
    /// By how much more the depth grows with x at its left than at its right, without unit.
    pub(crate) bend: f64,
}

/// The edges of what a mesh presses.
///
/// With `I` the penetration map, and for any functions `a(x)` and `b(y)`, by the divergence theorem
///
/// ```text
/// integral of I a b       = sum over edges of the integral of (rim z A(x) - bend B(x)) b(y) dy
/// integral of (I > 0) a b = sum over edges of the integral of rim A(x) b(y) dy
/// A' = a,   B' = A,   z = depth along the edge
/// ```
///
/// because `z A - (dI/dx) B` is the integral over x of `I a` on a face, and what two faces have in common at their edge cancels.
/// So an image takes as many terms as there are edges where the depth bends or ends, whatever the attitude.
///
/// All faces below the surface that face downwards are added up. Where one stands above another, as beside the notch of a tool that
/// leans, it is hidden, and its hidden part is taken off.
pub(crate) type Outline = Vec<Edge>;

/// A point of an edge and what it counts for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Node {
    pub(crate) x_mm: f64,
    pub(crate) y_mm: f64,
    /// Weight of `A(x) b(y)`.
    pub(crate) once: f64,
    /// Weight of `B(x) b(y)`.
    pub(crate) twice: f64,
}

impl Edge {
    /// Points along the edge, so close that sums over them agree with the integrals to about 1e-11 of the volume under a blur of
    /// `sigma_mm`.
    pub(crate) fn nodes(&self, cut: Cut, sigma_mm: f64) -> impl Iterator<Item = Node> {
        let [from, to] = self.ends_mm;
        let [goes_x, goes_y, goes_z] = [0, 1, 2].map(|axis| to[axis] - from[axis]);
        // An edge along x counts for nothing.
        let length_mm = if goes_y == 0.0 { 0.0 } else { goes_x.hypot(goes_y) };
        let counts = goes_y != 0.0 && (self.rim != 0.0 || cut == Cut::Penetration);
        smooth(0.0, length_mm, sigma_mm).filter(move |_| counts).map(move |(at_mm, width_mm)| {
            let share = at_mm / length_mm;
            let along_y_mm = width_mm / length_mm * goes_y;
            let [depth_mm, bend] = match cut {
                Cut::Penetration => [from[2] + share * goes_z, self.bend],
                Cut::Footprint => [1.0, 0.0],
            };
            Node {
                x_mm: from[0] + share * goes_x,
                y_mm: from[1] + share * goes_y,
                once: self.rim * depth_mm * along_y_mm,
                twice: -bend * along_y_mm,
            }
        })
    }
}

/// A face that stands steeper than this share of a right angle has no area seen from below. The strip that it hides is less than
/// a millionth of its height wide.
const UPRIGHT: f64 = 1e-6;

/// Depths that differ by less are the same.
const SAME_MM: f64 = 1e-9;

/// Faces that bend by less are one.
const SAME_BEND: f64 = 1e-12;

/// Parts with a smaller area are none.
const AREA_MIN_MM2: f64 = 1e-12;

/// Pairs of faces that may be compared to know what hides what.
const PAIRS_MAX: usize = 200_000;

/// How a triangle stands.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Face {
    /// It is above the surface or upright.
    Aside,
    /// A part of it is below the surface and faces downwards. The depth grows by this much with x.
    Seen(f64),
    /// A part of it is below the surface and faces upwards.
    Back,
}

impl Contact {
    /// The outline of the tool, whose face is deeper by `lean` per mm along its own x and y, and whose lowest point is at the contact's
    /// depth. `None` if the tool is no closed mesh, or if too much of it is hidden below the surface.
    pub(super) fn outline(&self, lean: [f64; 2]) -> Option<Outline> {
        let Self { indenter, position_mm: [x, y], rotation_deg, depth_mm } = self;
        let Indenter::Mesh(mesh) = indenter else { return None };
        let skin = mesh.skin()?;
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        let [_, _, [lowest, _]] = mesh.bounds_mm();
        let upright_mm = depth_mm - indenter.lowered_mm(lean);
        let mut outliner = Outliner::default();
        outliner.placed.extend(skin.points_mm.iter().map(|[u, v, w]| {
            let below_mm = upright_mm - (w - lowest) + lean[0] * u + lean[1] * v;
            [x + cos * u - sin * v, y + sin * u + cos * v, below_mm]
        }));
        outliner.outline(skin)?;
        Some(outliner.edges)
    }
}

/// Finds outlines, and keeps its memory from one to the next.
#[derive(Debug, Default)]
pub(crate) struct Outliner {
    /// The points of the skin: x, y and depth below the surface, sensor frame.
    pub(crate) placed: Vec<[f64; 3]>,
    faces: Vec<Face>,
    /// The outline that was found last.
    pub(crate) edges: Outline,
}

impl Outliner {
    /// Finds the outline of a skin whose points are placed. `None` if too much is hidden.
    pub(crate) fn outline(&mut self, skin: &Skin) -> Option<()> {
        let Self { placed, faces, edges } = self;
        let corners = |triangle: &[u32; 3]| triangle.map(|corner| placed[corner as usize]);
        faces.clear();
        faces.extend(skin.triangles.iter().map(|triangle| face(corners(triangle))));
        edges.clear();
        for Seam { ends, beside } in &skin.seams {
            // Seen from above, a triangle that faces downwards lies at the right of its edges.
            let [right, left] = beside.map(|triangle| faces[triangle as usize]);
            let [from, to] = ends.map(|end| placed[end as usize]);
            let (ends_mm, rim, bend) = match (left, right) {
                (Face::Seen(left), Face::Seen(right)) => ([from, to], 0.0, left - right),
                (Face::Seen(left), Face::Aside | Face::Back) => ([from, to], 1.0, left),
                (Face::Aside | Face::Back, Face::Seen(right)) => ([to, from], 1.0, right),
                (Face::Aside | Face::Back, Face::Aside | Face::Back) => continue,
            };
            if (rim != 0.0 || bend.abs() > SAME_BEND)
                && let Some(ends_mm) = part_below(ends_mm)
            {
                edges.push(Edge { ends_mm, rim, bend });
            }
        }
        // Where the surface cuts through a face.
        for (triangle, face) in skin.triangles.iter().zip(&*faces) {
            if let Face::Seen(bend) = face
                && let Some(ends_mm) = waterline(corners(triangle))
            {
                edges.push(Edge { ends_mm, rim: 1.0, bend: *bend });
            }
        }
        if faces.contains(&Face::Back) {
            let parts = |of: fn(&Face) -> bool| {
                let those = skin.triangles.iter().zip(&*faces).filter(move |(_, face)| of(face));
                those.map(|(triangle, _)| below_surface(corners(triangle))).collect::<Vec<_>>()
            };
            let backs = parts(|face| *face == Face::Back);
            take_off_hidden(&backs, &parts(|face| matches!(face, Face::Seen(_))), edges)?;
        }
        Some(())
    }
}

fn face([a, b, c]: [[f64; 3]; 3]) -> Face {
    if a[2].max(b[2]).max(c[2]) <= 0.0 {
        return Face::Aside;
    }
    let [p, q] = [b, c].map(|corner| [corner[0] - a[0], corner[1] - a[1], corner[2] - a[2]]);
    let [along_x, along_y, area] =
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    // Depth counts downwards, so that corners counter-clockwise from outside are clockwise from above where a face looks down.
    if area.abs() <= UPRIGHT * along_x.hypot(along_y) {
        Face::Aside
    } else if area < 0.0 {
        Face::Seen(-along_x / area)
    } else {
        Face::Back
    }
}

/// The part of an edge below the surface.
fn part_below([from, to]: [[f64; 3]; 2]) -> Option<[[f64; 3]; 2]> {
    match (from[2] > 0.0, to[2] > 0.0) {
        (true, true) => Some([from, to]),
        (true, false) => Some([from, at_surface(from, to)]),
        (false, true) => Some([at_surface(to, from), to]),
        (false, false) => None,
    }
}

/// Where the surface cuts through a triangle that faces downwards, what is below at the left hand.
fn waterline([a, b, c]: [[f64; 3]; 3]) -> Option<[[f64; 3]; 2]> {
    // Its corners run clockwise seen from above.
    let mut ends = [None; 2];
    for (from, to) in [(c, b), (b, a), (a, c)] {
        match (from[2] > 0.0, to[2] > 0.0) {
            (true, false) => ends[0] = Some(at_surface(from, to)),
            (false, true) => ends[1] = Some(at_surface(to, from)),
            _ => {}
        }
    }
    Some([ends[0]?, ends[1]?])
}

/// Where an edge from below to above the surface cuts it.
fn at_surface(below: [f64; 3], above: [f64; 3]) -> [f64; 3] {
    let share = below[2] / (below[2] - above[2]);
    let along = |axis: usize| below[axis] + share * (above[axis] - below[axis]);
    [along(0), along(1), 0.0]
}

/// Takes off what is hidden. A line upwards comes into the tool, leaves it through one of the `backs`, and where it then comes into it
/// again through one of the faces that are `seen`, that face is hidden. `None` if that happens twice on a line.
fn take_off_hidden(backs: &[Vec<[f64; 3]>], seen: &[Vec<[f64; 3]>], edges: &mut Outline) -> Option<()> {
    if backs.len() * seen.len() > PAIRS_MAX {
        return None;
    }
    for face in seen {
        let hidden: Vec<_> = backs.iter().filter_map(|back| part_above(face, back)).collect();
        for (place, (polygon, along_x)) in hidden.iter().enumerate() {
            if hidden[place + 1..].iter().any(|(other, _)| centre(&common(polygon, other)).is_some()) {
                return None;
            }
            let around = polygon.iter().zip(polygon.iter().cycle().skip(1));
            edges.extend(around.map(|(from, to)| Edge { ends_mm: [*from, *to], rim: -1.0, bend: -along_x }));
        }
    }
    Some(())
}

/// The part of a face that stands above another, counter-clockwise, and how the face's depth grows with x. Both are convex, and do not
/// pass through each other.
fn part_above(face: &[[f64; 3]], other: &[[f64; 3]]) -> Option<(Vec<[f64; 3]>, f64)> {
    let range = |polygon: &[[f64; 3]], axis: usize| {
        let of_axis = polygon.iter().map(|corner| corner[axis]);
        of_axis.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mm| [least.min(mm), most.max(mm)])
    };
    let apart = |axis: usize| {
        let ([from, to], [other_from, other_to]) = (range(face, axis), range(other, axis));
        to <= other_from || other_to <= from
    };
    if apart(0) || apart(1) || range(face, 2)[0] >= range(other, 2)[1] {
        return None;
    }
    let common = common(face, other);
    let middle = centre(&common)?;
    let depth = |[at, along_x, along_y]: [f64; 3], [x, y]: [f64; 2]| at + along_x * x + along_y * y;
    let (face, other) = (plane(face)?, plane(other)?);
    let corner = |place: &[f64; 2]| [place[0], place[1], depth(face, *place)];
    (depth(face, middle) < depth(other, middle) - SAME_MM)
        .then(|| (common.iter().map(corner).collect(), face[1]))
}

/// The middle of a convex polygon; `None` if it has no area.
fn centre<const N: usize>(polygon: &[[f64; N]]) -> Option<[f64; 2]> {
    let [first, rest @ ..] = polygon else { return None };
    let (mut area, mut middle) = (0.0, [0.0; 2]);
    for [p, q] in rest.array_windows::<2>() {
        let twice = turn(first, p, q);
        area += twice;
        for axis in [0, 1] {
            middle[axis] += twice * (first[axis] + p[axis] + q[axis]) / 3.0;
        }
    }
    (area.abs() > 2.0 * AREA_MIN_MM2).then(|| middle.map(|sum| sum / area))
}

/// Depth of a polygon's plane at the origin, and how it grows with x and y.
fn plane(polygon: &[[f64; 3]]) -> Option<[f64; 3]> {
    let [a, rest @ ..] = polygon else { return None };
    let mut normal = [0.0; 3];
    for [b, c] in rest.array_windows::<2>() {
        let [p, q] = [b, c].map(|corner| [corner[0] - a[0], corner[1] - a[1], corner[2] - a[2]]);
        normal[0] += p[1] * q[2] - p[2] * q[1];
        normal[1] += p[2] * q[0] - p[0] * q[2];
        normal[2] += p[0] * q[1] - p[1] * q[0];
    }
    let [along_x, along_y] = [-normal[0] / normal[2], -normal[1] / normal[2]];
    (along_x.is_finite() && along_y.is_finite())
        .then(|| [a[2] - along_x * a[0] - along_y * a[1], along_x, along_y])
}

/// What two convex polygons have in common, seen from above, counter-clockwise.
fn common<const N: usize>(one: &[[f64; N]], other: &[[f64; N]]) -> Vec<[f64; 2]> {
    let counter_clockwise = |polygon: &[[f64; N]]| {
        let mut flat: Vec<[f64; 2]> = polygon.iter().map(|corner| [corner[0], corner[1]]).collect();
        let around: f64 =
            (2..flat.len()).map(|corner| turn(&flat[0], &flat[corner - 1], &flat[corner])).sum();
        if around < 0.0 {
            flat.reverse();
        }
        flat
    };
    let (mut left, border) = (counter_clockwise(one), counter_clockwise(other));
    for (from, to) in border.iter().zip(border.iter().cycle().skip(1)) {
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (here, next) in left.iter().zip(left.iter().cycle().skip(1)) {
            let [at_here, at_next] = [here, next].map(|point| turn(from, to, point));
            if at_here >= 0.0 {
                kept.push(*here);
            }
            if (at_here > 0.0 && at_next < 0.0) || (at_here < 0.0 && at_next > 0.0) {
                let share = at_here / (at_here - at_next);
                kept.push([0, 1].map(|axis| here[axis] + share * (next[axis] - here[axis])));
            }
        }
        left = kept;
    }
    left
}

#[cfg(test)]
#[path = "outline_tests.rs"]
mod tests;
