//! Closed surfaces and how they are made.

use super::outline::{polar, triangles};

/// Triangles that enclose a solid, or several that may overlap; in mm.
///
/// Seen from outside, the corners of every triangle run counter-clockwise. A [`Mesh`](tactus_model::Mesh) does not need
/// this order.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    vertices_mm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The vertices, in mm.
    pub fn vertices_mm(&self) -> &[[f64; 3]] {
        &self.vertices_mm
    }

    /// The triangles, each by the indices of its corners.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of every triangle, in mm.
    pub fn corners_mm(&self) -> impl ExactSizeIterator<Item = [[f64; 3]; 3]> {
        self.triangles.iter().map(|corners| corners.map(|vertex| self.vertices_mm[vertex as usize]))
    }

    /// All parts as one.
    pub(super) fn of(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut whole = Self { vertices_mm: Vec::new(), triangles: Vec::new() };
        for part in parts {
            let before = index(whole.vertices_mm.len());
            whole.vertices_mm.extend(part.vertices_mm);
            whole
                .triangles
                .extend(part.triangles.iter().map(|corners| corners.map(|vertex| before + vertex)));
        }
        whole
    }

    /// Every vertex moved by a rule that mirrors nothing, or the inside would turn out.
    pub(super) fn map(mut self, rule: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        self.vertices_mm.iter_mut().for_each(|vertex| *vertex = rule(*vertex));
        self
    }

    pub(super) fn moved(self, by_mm: [f64; 3]) -> Self {
        self.map(|mm| std::array::from_fn(|axis| mm[axis] + by_mm[axis]))
    }

    /// Moved to where a tool stands: its lowest point at z = 0, its middle at x = y = 0.
    ///
    /// Coordinates are rounded to what STL holds, so that its file is the very shape.
    pub(super) fn placed(self) -> Self {
        let span = |axis: usize| {
            let along = self.vertices_mm.iter().map(|vertex| vertex[axis]);
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], mm| [least.min(mm), most.max(mm)])
        };
        let [[left, right], [front, back], [bottom, _]] = [span(0), span(1), span(2)];
        #[expect(clippy::cast_possible_truncation, reason = "STL holds f32")]
        let to_stl = |mm: f64| f64::from(mm as f32);
        self.moved([-f64::midpoint(left, right), -f64::midpoint(front, back), -bottom])
            .map(|mm| mm.map(to_stl))
    }
}

/// A prism: an outline with or without a hole, its walls upright between two heights.
pub(super) fn extrude(outer: &[[f64; 2]], hole: &[[f64; 2]], [from_mm, to_mm]: [f64; 2]) -> Surface {
    let corners = [outer, hole].concat();
    let count = corners.len();
    let at = |z: f64| corners.iter().map(move |[x, y]| [*x, *y, z]);
    let face = triangles(outer, hole);
    let top = face.iter().map(|corners| corners.map(|corner| count + corner));
    let bottom = face.iter().map(|[a, b, c]| [*a, *c, *b]);
    let edges = around(0, outer.len()).chain(around(outer.len(), hole.len()));
    let walls = edges.flat_map(|[a, b]| wall([a, b], [count + a, count + b]));
    Surface {
        vertices_mm: at(from_mm).chain(at(to_mm)).collect(),
        triangles: top.chain(bottom).chain(walls).map(|corners| corners.map(index)).collect(),
    }
}

/// A solid of revolution about z. `profile` gives radius and height of its corners and goes up at its outer
/// side, from the axis to the axis.
pub(super) fn revolve(profile: &[[f64; 2]], sides: usize) -> Surface {
    let [[_, bottom], rings @ .., [_, top]] = profile else {
        return Surface::of([]);
    };
    let ring = |radius: f64, z: f64| {
        (0..sides).map(move |side| {
            let [x, y] = polar([0.0; 2], radius, 360.0 * side as f64 / sides as f64);
            [x, y, z]
        })
    };
    let poles = [[0.0, 0.0, *bottom], [0.0, 0.0, *top]];
    let vertices_mm =
        poles.into_iter().chain(rings.iter().flat_map(|[radius, z]| ring(*radius, *z))).collect();

    // The poles come first, then the rings, bottom to top.
    let start = |ring: usize| poles.len() + ring * sides;
    let last = rings.len().saturating_sub(1);
    let below = around(start(0), sides).map(|[a, b]| [0, b, a]);
    let above = around(start(last), sides).map(|[a, b]| [1, a, b]);
    let bands = (0..last).flat_map(|ring| {
        around(start(ring), sides).flat_map(move |[a, b]| wall([a, b], [a + sides, b + sides]))
    });
    Surface {
        vertices_mm,
        triangles: below.chain(above).chain(bands).map(|corners| corners.map(index)).collect(),
    }
}

/// An ellipsoid of the given half axes along x, y and z.
pub(super) fn ellipsoid(half_mm: [f64; 3]) -> Surface {
    const BANDS: u32 = 12;
    let profile: Vec<_> = (0..=BANDS)
        .map(|band| polar([0.0; 2], 1.0, 180.0 * f64::from(band) / f64::from(BANDS) - 90.0))
        .collect();
    revolve(&profile, 20).map(|mm| std::array::from_fn(|axis| half_mm[axis] * mm[axis]))
}

/// Edges of a closed row of vertices.
fn around(first: usize, count: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..count).map(move |step| [first + step, first + (step + 1) % count])
}

/// A quadrilateral in two triangles; seen from outside, its lower edge `a b` runs to the right, as `c d` above.
fn wall([a, b]: [usize; 2], [c, d]: [usize; 2]) -> [[usize; 3]; 2] {
    [[a, b, d], [a, d, c]]
}

/// Made shapes have a few thousand vertices.
fn index(vertex: usize) -> u32 {
    u32::try_from(vertex).unwrap_or(u32::MAX)
}
