//! Whether a mesh is the skin of a solid: closed, and not cutting itself.

use std::collections::HashMap;

use crate::Mesh;

/// The surface of one or several solids, none of them within another.
///
/// A line into a solid goes in and out in turns. So of such a surface it is known what is visible from below without comparing
/// each triangle with each other, and an image follows from its edges alone: see [`Outline`](crate::contact::Outline).
#[derive(Debug, Clone)]
pub(crate) struct Skin {
    /// The places of the corners, each once, in mm, tool frame.
    pub(crate) points_mm: Vec<[f64; 3]>,
    /// Corners of each triangle, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Every edge once.
    pub(crate) seams: Vec<Seam>,
}

/// An edge, where two triangles meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Seam {
    /// Its ends.
    pub(crate) ends: [u32; 2],
    /// The triangle that has the ends in this order, and the one that has them in the other.
    pub(crate) beside: [u32; 2],
}

/// Pairs of triangles that may be compared, at most. A surface that needs more is not looked at, and counts as none.
const PAIRS_MAX: usize = 20_000_000;

/// Triangles closer than this share of the surface's extent touch.
const TOUCH: f64 = 1e-9;

impl Skin {
    /// The mesh as a skin; `None` if it is open, has an edge of three triangles, cuts or touches itself, or has a solid within
    /// another. The order of a triangle's corners does not matter.
    pub(crate) fn of(mesh: &Mesh) -> Option<Self> {
        let mut skin = Self::welded(mesh);
        skin.seams = seams(&skin.triangles)?;
        let shells = skin.turn_outside()?;
        (!skin.nests(&shells) && !skin.cuts_itself()).then_some(skin)
    }

    /// Corners at the same place become one.
    fn welded(mesh: &Mesh) -> Self {
        let mut known = HashMap::new();
        let mut points_mm = Vec::new();
        let welded: Vec<u32> = mesh
            .vertices_mm()
            .iter()
            .map(|place_mm| {
                // 0.0 is -0.0.
                let key = place_mm.map(|mm| (mm + 0.0).to_bits());
                *known.entry(key).or_insert_with(|| {
                    points_mm.push(*place_mm);
                    // As many as vertices, whose indices are `u32`.
                    u32::try_from(points_mm.len() - 1).unwrap_or(u32::MAX)
                })
            })
            .collect();
        let triangles = mesh.triangles().iter().map(|corners| corners.map(|corner| welded[corner as usize]));
        Self { points_mm, triangles: triangles.collect(), seams: Vec::new() }
    }

    /// Orders all corners counter-clockwise seen from outside, and seams with them. Gives for each triangle the number of the
    /// connected surface that it is of; `None` if a surface has one side only, or no volume.
    fn turn_outside(&mut self) -> Option<Vec<usize>> {
        let mut around = vec![[0; 3]; self.triangles.len()];
        let mut known = vec![0; self.triangles.len()];
        for (seam, Seam { beside, .. }) in self.seams.iter().enumerate() {
            for triangle in beside.map(|triangle| triangle as usize) {
                // Each has three edges.
                around[triangle][known[triangle]] = seam;
                known[triangle] += 1;
            }
        }
        let mut shells = vec![None; self.triangles.len()];
        let mut count = 0;
        for first in 0..self.triangles.len() {
            if shells[first].is_some() {
                continue;
            }
            shells[first] = Some(count);
            let mut members = vec![first];
            let mut next = 0;
            while let Some(triangle) = members.get(next).copied() {
                next += 1;
                for seam in around[triangle] {
                    let Seam { ends, beside: [one, other] } = self.seams[seam];
                    let (one, other) = (one as usize, other as usize);
                    let neighbour = if one == triangle { other } else { one };
                    let is_turned =
                        has(self.triangles[triangle], ends) == has(self.triangles[neighbour], ends);
                    if shells[neighbour].is_none() {
                        shells[neighbour] = Some(count);
                        members.push(neighbour);
                        if is_turned {
                            self.triangles[neighbour].swap(1, 2);
                        }
                    } else if is_turned {
                        return None;
                    }
                }
            }
            let volume: f64 = members.iter().map(|member| self.six_volumes_mm3(*member)).sum();
            if volume == 0.0 {
                return None;
            }
            if volume < 0.0 {
                for member in members {
                    self.triangles[member].swap(1, 2);
                }
            }
            count += 1;
        }
        for seam in &mut self.seams {
            if !has(self.triangles[seam.beside[0] as usize], seam.ends) {
                seam.beside.swap(0, 1);
            }
        }
        shells.into_iter().collect()
    }

    /// Six times the signed volume between a triangle and the first point.
    fn six_volumes_mm3(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners_mm(triangle).map(|corner| minus(corner, self.points_mm[0]));
        dot(a, cross(b, c))
    }

    /// Whether the extent of a connected surface lies within that of another: one may be within the other, which is not looked at
    /// closer.
    fn nests(&self, shells: &[usize]) -> bool {
        let count = shells.iter().max().map_or(0, |last| last + 1);
        let mut boxes = vec![NO_BOX; count];
        for (triangle, shell) in shells.iter().enumerate() {
            boxes[*shell] = joined(boxes[*shell], extent_mm(self.corners_mm(triangle)));
        }
        let within = |inner: &Extent, outer: &Extent| {
            inner.iter().zip(outer).all(|(inner, outer)| inner[0] >= outer[0] && inner[1] <= outer[1])
        };
        // Bounded, as everything here.
        count > 100
            || (0..count)
                .any(|one| (0..count).any(|other| one != other && within(&boxes[one], &boxes[other])))
    }

    /// Whether two triangles meet elsewhere than in what they share.
    fn cuts_itself(&self) -> bool {
        let mut boxes: Vec<(Extent, usize)> = (0..self.triangles.len())
            .map(|triangle| (extent_mm(self.corners_mm(triangle)), triangle))
            .collect();
        let whole = boxes.iter().fold(NO_BOX, |whole, (extent, _)| joined(whole, *extent));
        let touch_mm = TOUCH * whole.iter().map(|[least, most]| most - least).fold(0.0, f64::max);
        boxes.sort_by(|(one, _), (other, _)| one[0][0].total_cmp(&other[0][0]));
        let mut pairs = 0;
        for (place, (extent, triangle)) in boxes.iter().enumerate() {
            for (other_extent, other) in &boxes[place + 1..] {
                if other_extent[0][0] > extent[0][1] + touch_mm {
                    break;
                }
                pairs += 1;
                if pairs > PAIRS_MAX {
                    return true;
                }
                let apart = |axis: usize| {
                    other_extent[axis][0] > extent[axis][1] + touch_mm
                        || extent[axis][0] > other_extent[axis][1] + touch_mm
                };
                if !apart(1) && !apart(2) && self.meet(*triangle, *other, touch_mm) {
                    return true;
                }
            }
        }
        false
    }

    /// Whether two triangles meet elsewhere than in the corners and the edge that they share.
    fn meet(&self, one: usize, other: usize, touch_mm: f64) -> bool {
        let shared = |corner: &u32, triangle: usize| self.triangles[triangle].contains(corner);
        let own = |triangle: usize, beside: usize| {
            (0..3).filter(move |corner| !shared(&self.triangles[triangle][*corner], beside))
        };
        let corners = [one, other].map(|triangle| self.corners_mm(triangle));
        match own(one, other).count() {
            // No corner in common: any edge of either may reach the other.
            3 => [(0, 1), (1, 0)].into_iter().any(|(edges, face)| {
                let [a, b, c] = corners[edges];
                [[a, b], [b, c], [c, a]].into_iter().any(|edge| reaches(edge, corners[face], touch_mm))
            }),
            // One: the edge opposite to it.
            2 => [(one, other, 0), (other, one, 1)].into_iter().any(|(edges, face, place)| {
                let mut opposite = own(edges, face).map(|corner| corners[place][corner]);
                match (opposite.next(), opposite.next()) {
                    (Some(from), Some(to)) => reaches([from, to], corners[1 - place], touch_mm),
                    _ => true,
                }
            }),
            // An edge: they lie on each other if they are flat and on the same side of it.
            1 => {
                let apex = |triangle: usize, beside: usize, place: usize| {
                    own(triangle, beside).map(|corner| corners[place][corner]).next()
                };
                let common = (0..3).filter(|corner| shared(&self.triangles[one][*corner], other));
                let common: Vec<_> = common.map(|corner| corners[0][corner]).collect();
                match (apex(one, other, 0), apex(other, one, 1), common.as_slice()) {
                    (Some(here), Some(there), [a, b]) => {
                        let along = minus(*b, *a);
                        let (upright, beyond) = (cross(along, minus(here, *a)), minus(there, *a));
                        dot(upright, beyond).abs() <= touch_mm * dot(upright, upright).sqrt()
                            && dot(upright, cross(along, beyond)) > 0.0
                    }
                    _ => true,
                }
            }
            _ => true,
        }
    }

    fn corners_mm(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|corner| self.points_mm[corner as usize])
    }
}

/// Every edge with its two triangles; `None` if one has another number of them.
fn seams(triangles: &[[u32; 3]]) -> Option<Vec<Seam>> {
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    let mut all: Vec<([u32; 2], u32)> = (0_u32..)
        .zip(triangles)
        .flat_map(|(triangle, corners)| {
            sides(*corners).map(|[from, to]| ([from.min(to), from.max(to)], triangle))
        })
        .collect();
    all.sort_unstable();
    let (pairs, rest) = all.as_chunks::<2>();
    let alone = pairs.windows(2).all(|pairs| pairs[0][0].0 != pairs[1][0].0);
    let paired = pairs.iter().all(|[(one, _), (other, _)]| one == other && one[0] != one[1]);
    (rest.is_empty() && alone && paired).then(|| {
        pairs.iter().map(|[(ends, one), (_, other)]| Seam { ends: *ends, beside: [*one, *other] }).collect()
    })
}

/// Whether a triangle has these corners one after the other.
fn has([a, b, c]: [u32; 3], ends: [u32; 2]) -> bool {
    [[a, b], [b, c], [c, a]].contains(&ends)
}

/// Whether a line reaches a triangle, or comes as close to it as `touch_mm`.
fn reaches([from, to]: [[f64; 3]; 2], [a, b, c]: [[f64; 3]; 3], touch_mm: f64) -> bool {
    let upright = cross(minus(b, a), minus(c, a));
    let length = dot(upright, upright).sqrt();
    let [above_from, above_to] = [from, to].map(|end| dot(upright, minus(end, a)) / length);
    if above_from.min(above_to) > touch_mm || above_from.max(above_to) < -touch_mm {
        return false;
    }
    // What matters is how it looks along the triangle's normal.
    let [u, v] = match upright.map(f64::abs) {
        [x, y, z] if x >= y && x >= z => [1, 2],
        [_, y, z] if y >= z => [2, 0],
        _ => [0, 1],
    };
    let flat = |point: [f64; 3]| [point[u], point[v]];
    let triangle = [a, b, c].map(flat);
    if (above_from - above_to).abs() > 2.0 * touch_mm {
        let share = (above_from / (above_from - above_to)).clamp(0.0, 1.0);
        let through: [f64; 3] = std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]));
        return is_within(flat(through), triangle, touch_mm);
    }
    let line = [from, to].map(flat);
    let [p, q, r] = triangle;
    line.iter().any(|end| is_within(*end, triangle, touch_mm))
        || [[p, q], [q, r], [r, p]].iter().any(|side| cross_each_other(line, *side))
}

/// Whether a point lies in a triangle, or as close to it as `touch_mm`.
fn is_within(point: [f64; 2], [p, q, r]: [[f64; 2]; 3], touch_mm: f64) -> bool {
    let sign = turn(&p, &q, &r).signum();
    [[p, q], [q, r], [r, p]].iter().all(|[from, to]| {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        sign * turn(from, to, &point) >= -touch_mm * length
    })
}

fn cross_each_other([a, b]: [[f64; 2]; 2], [c, d]: [[f64; 2]; 2]) -> bool {
    // Lines along one line have no sides: their extents tell whether they meet.
    let overlap = |axis: usize| {
        a[axis].max(b[axis]) >= c[axis].min(d[axis]) && c[axis].max(d[axis]) >= a[axis].min(b[axis])
    };
    overlap(0)
        && overlap(1)
        && turn(&a, &b, &c) * turn(&a, &b, &d) <= 0.0
        && turn(&c, &d, &a) * turn(&c, &d, &b) <= 0.0
}

/// Twice the area of three points seen along z, positive if they turn left.
pub(crate) fn turn<const N: usize>(p: &[f64; N], q: &[f64; N], r: &[f64; N]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Least and greatest x, y and z.
type Extent = [[f64; 2]; 3];

const NO_BOX: Extent = [[f64::INFINITY, f64::NEG_INFINITY]; 3];

fn extent_mm(corners: [[f64; 3]; 3]) -> Extent {
    std::array::from_fn(|axis| {
        let [a, b, c] = corners.map(|corner| corner[axis]);
        [a.min(b).min(c), a.max(b).max(c)]
    })
}

fn joined(one: Extent, other: Extent) -> Extent {
    std::array::from_fn(|axis| [one[axis][0].min(other[axis][0]), one[axis][1].max(other[axis][1])])
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 3] {
    [b * f - c * e, c * d - a * f, a * e - b * d]
}

#[cfg(test)]
#[path = "skin_tests.rs"]
mod tests;
