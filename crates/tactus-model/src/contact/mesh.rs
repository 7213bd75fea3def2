//! Meshes: the penetration map without a raster.
//!
//! A plane of constant x cuts the triangles below the surface in lines, and the deepest line at every y is in contact.
//! The lines change smoothly with x, except at corners, at crossings of edges (seen from below) and where edges pass
//! through a triangle. A quadrature whose panels end at these x is exact to about 1e-9. For tools with many corners,
//! corners closer than 1/64 of the blur share a panel and crossings are ignored; the error is then about 1e-5 of the
//! image's peak.

use super::{Cut, Line, Slice, stack};
use crate::Mesh;
use crate::quadrature::smooth;
use crate::skin::turn;

/// Corners of a triangle below the surface: x, y and how far below, sensor frame.
type Facet = [[f64; 3]; 3];

/// Slices of a mesh that leans. `depth_mm` is the depth of its lowest point when upright.
pub(super) fn slices(
    cut: Cut,
    mesh: &Mesh,
    position_mm: [f64; 2],
    rotation_deg: f64,
    depth_mm: f64,
    lean: [f64; 2],
    sigma_mm: f64,
) -> Vec<Slice> {
    let [[least_x, most_x], _, _] = mesh.bounds_mm();
    let sigma_mm = sigma_mm.max((most_x - least_x) / 1000.0);
    let facets = facets(mesh, position_mm, rotation_deg, depth_mm, lean);
    let mut slices = Vec::new();
    for panel in panels(&facets, sigma_mm / 64.0) {
        let [from, to] = panel;
        let crossed: Vec<&Facet> = facets.iter().filter(|facet| overlaps(facet, panel)).collect();
        // Where an edge is nearly parallel to y, a line's end moves far within a narrow panel.
        let goes_mm = crossed.iter().map(|facet| goes_mm(facet, to - from)).fold(to - from, f64::max);
        for (x_mm, width_mm) in smooth(from, to, sigma_mm * (to - from) / goes_mm) {
            let lines: Vec<Line> = crossed.iter().filter_map(|facet| line_at(facet, x_mm)).collect();
            for line in deepest(&lines) {
                if cut == Cut::Footprint {
                    slices.push(Slice {
                        x_mm,
                        y_mm: line.map(|[y_mm, _]| y_mm),
                        weight_mm2: width_mm,
                        slope_mm: 0.0,
                    });
                } else {
                    stack(x_mm, width_mm, line, sigma_mm, &mut slices);
                }
            }
        }
    }
    slices
}

/// The parts of the triangles that stand below the surface.
fn facets(mesh: &Mesh, [x, y]: [f64; 2], rotation_deg: f64, depth_mm: f64, lean: [f64; 2]) -> Vec<Facet> {
    let (sin, cos) = rotation_deg.to_radians().sin_cos();
    let [_, _, [lowest, _]] = mesh.bounds_mm();
    let place = |[u, v, w]: [f64; 3]| {
        let below_mm = depth_mm - (w - lowest) + lean[0] * u + lean[1] * v;
        [x + cos * u - sin * v, y + sin * u + cos * v, below_mm]
    };
    let mut facets = Vec::new();
    for corners in mesh.corners_mm() {
        let polygon = below_surface(corners.map(place));
        // A fan about the first corner.
        if let [first, rest @ ..] = polygon.as_slice() {
            let fan = rest.windows(2).map(|pair| [*first, pair[0], pair[1]]);
            facets.extend(fan.filter(|[a, b, c]| turn(a, b, c) != 0.0));
        }
    }
    facets
}

/// The part of a triangle below the surface: three or four corners, or none.
pub(super) fn below_surface(facet: Facet) -> Vec<[f64; 3]> {
    let mut polygon = Vec::with_capacity(4);
    for (corner, next) in [(0, 1), (1, 2), (2, 0)].map(|(one, other)| (facet[one], facet[other])) {
        if corner[2] > 0.0 {
            polygon.push(corner);
        }
        if (corner[2] > 0.0) != (next[2] > 0.0) {
            let share = corner[2] / (corner[2] - next[2]);
            let along = |axis: usize| corner[axis] + share * (next[axis] - corner[axis]);
            polygon.push([along(0), along(1), 0.0]);
        }
    }
    polygon
}

/// Tools with more facets have corners so close together that crossings of edges do not matter.
const FEW_FACETS: usize = 200;

/// Ranges of x between the corners of facets and the crossings of their edges; with many facets, those that
/// are narrower than `least_mm` together share a range.
fn panels(facets: &[Facet], least_mm: f64) -> Vec<[f64; 2]> {
    let mut corners: Vec<f64> = facets.iter().flatten().map(|[x, _, _]| *x).collect();
    let few = facets.len() <= FEW_FACETS;
    if few {
        let edges: Vec<_> = facets.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        for (place, one) in edges.iter().enumerate() {
            corners.extend(edges[place + 1..].iter().filter_map(|other| crossing_x(one, other)));
            corners.extend(facets.iter().filter_map(|facet| pierced_x(one, facet)));
        }
    }
    corners.sort_by(f64::total_cmp);
    corners.dedup();
    let mut panels: Vec<[f64; 2]> = Vec::new();
    for corner in corners.windows(2) {
        match panels.last_mut() {
            Some([from, to]) if !few && corner[1] - *from < least_mm => *to = corner[1],
            _ => panels.push([corner[0], corner[1]]),
        }
    }
    panels
}

/// Where two edges cross, seen from below, other than at their ends.
fn crossing_x([a, b]: &[[f64; 3]; 2], [c, d]: &[[f64; 3]; 2]) -> Option<f64> {
    let (of_c, of_d) = (turn(a, b, c), turn(a, b, d));
    let (of_a, of_b) = (turn(c, d, a), turn(c, d, b));
    (of_c * of_d < 0.0 && of_a * of_b < 0.0).then(|| c[0] + (d[0] - c[0]) * of_c / (of_c - of_d))
}

fn overlaps(facet: &Facet, [from, to]: [f64; 2]) -> bool {
    facet.iter().any(|[x, _, _]| *x > from) && facet.iter().any(|[x, _, _]| *x < to)
}

/// Where an edge passes through a facet from one side to the other.
fn pierced_x([from, to]: &[[f64; 3]; 2], [a, b, c]: &Facet) -> Option<f64> {
    let whole = turn(a, b, c);
    // Barycentric weights, and how far a point stands beyond the facet's plane.
    let weights =
        |point: &[f64; 3]| [turn(b, c, point), turn(c, a, point), turn(a, b, point)].map(|w| w / whole);
    let beyond = |point: &[f64; 3]| {
        let [wa, wb, wc] = weights(point);
        point[2] - (wa * a[2] + wb * b[2] + wc * c[2])
    };
    let (before, after) = (beyond(from), beyond(to));
    if before * after >= 0.0 {
        return None;
    }
    let share = before / (before - after);
    let point: [f64; 3] = std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]));
    weights(&point).iter().all(|weight| *weight > -1e-9).then_some(point[0])
}

/// Greatest change of y along a facet's edges within a width of x.
fn goes_mm([a, b, c]: &Facet, width_mm: f64) -> f64 {
    let edges = [[a, b], [b, c], [c, a]].map(|[from, to]| [(to[0] - from[0]).abs(), (to[1] - from[1]).abs()]);
    // An edge parallel to y is a panel's border.
    let slanting = edges.into_iter().filter(|[along_x, _]| *along_x > 0.0);
    slanting.map(|[along_x, along_y]| along_y * (width_mm / along_x).min(1.0)).fold(0.0, f64::max)
}

/// The line in which a plane of constant x cuts a facet, from least to greatest y.
fn line_at(facet: &Facet, x_mm: f64) -> Option<Line> {
    let [a, b, c] = *facet;
    let crossed =
        [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| (from[0] < x_mm) != (to[0] < x_mm));
    let mut ends = crossed.map(|(from, to)| {
        let share = (x_mm - from[0]) / (to[0] - from[0]);
        [from[1] + share * (to[1] - from[1]), from[2] + share * (to[2] - from[2])]
    });
    let (one, other) = (ends.next()?, ends.next()?);
    Some(if one[0] <= other[0] { [one, other] } else { [other, one] })
}

/// The deepest of several lines at every y, as lines that do not overlap. Collinear neighbours are joined.
fn deepest(lines: &[Line]) -> Vec<Line> {
    let mut ends: Vec<f64> = lines.iter().flatten().map(|[y, _]| *y).collect();
    ends.sort_by(f64::total_cmp);
    ends.dedup();
    let mut visible: Vec<Line> = Vec::new();
    for pair in ends.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        let there: Vec<Line> =
            lines.iter().filter(|[[start, _], [end, _]]| *start <= from && *end >= to).copied().collect();
        let deeper =
            |a: &&Line, b: &&Line| at(a, from).total_cmp(&at(b, from)).then(at(a, to).total_cmp(&at(b, to)));
        let Some(mut line) = there.iter().max_by(deeper).copied() else { continue };
        loop {
            // The first of the lines that come to stand deeper before the end.
            let next = there
                .iter()
                .filter(|other| at(other, to) > at(&line, to))
                .map(|other| (crossing(&line, other, [from, to]), *other))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(at(&b.1, to).total_cmp(&at(&a.1, to))));
            let end = next.map_or(to, |(crossing, _)| crossing);
            append(&mut visible, [[from, at(&line, from)], [end, at(&line, end)]]);
            match next {
                Some((crossing, deeper)) => (from, line) = (crossing, deeper),
                None => break,
            }
        }
    }
    visible
}

/// Depth of a line below the surface at `y`.
fn at(line: &Line, y: f64) -> f64 {
    let [[from, below_from], [to, below_to]] = *line;
    if to > from { below_from + (below_to - below_from) * (y - from) / (to - from) } else { below_from }
}

/// Where `other`, which stands no deeper than `line` at the range's start and deeper at its end, crosses it.
fn crossing(line: &Line, other: &Line, [from, to]: [f64; 2]) -> f64 {
    let (above, below) = (at(line, from) - at(other, from), at(other, to) - at(line, to));
    (from + (to - from) * above / (above + below)).clamp(from, to)
}

fn append(visible: &mut Vec<Line>, line: Line) {
    let [[from, below_from], [to, below_to]] = line;
    if to <= from {
        return;
    }
    if let Some([start, end]) = visible.last_mut() {
        let slope = |[a, below_a]: [f64; 2], [b, below_b]: [f64; 2]| (below_b - below_a) / (b - a);
        let straight = (slope(*start, *end) - slope(line[0], line[1])).abs() < 1e-9;
        if end[0].total_cmp(&from).is_eq() && (end[1] - below_from).abs() < 1e-12 && straight {
            *end = [to, below_to];
            return;
        }
    }
    visible.push(line);
}
