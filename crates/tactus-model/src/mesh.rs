//! The surface of a tool as triangles.

use std::sync::OnceLock;

use crate::skin::Skin;

/// Triangles in the tool's frame: z up, the tool's axis at x = y = 0, in mm.
///
/// Only surfaces that are visible from below make contact, so the mesh need not be closed: through a hole the next surface
/// above is visible. The order of a triangle's corners does not matter.
#[derive(Debug, Clone)]
pub struct Mesh {
    vertices_mm: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    bounds_mm: [[f64; 2]; 3],
    /// Known once it was asked for; `None` if it is none.
    skin: OnceLock<Option<Skin>>,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        self.vertices_mm == other.vertices_mm && self.triangles == other.triangles
    }
}

/// Why triangles do not make a tool.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum MeshError {
    /// No triangle can be seen from below: none is given, or all stand upright or have no area.
    #[error("no triangle of the mesh can be seen from below: it needs a surface that is not upright")]
    Empty,
    /// A coordinate is not a finite number.
    #[error("vertex {vertex} is not finite")]
    NotFinite { vertex: usize },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    NoVertex { triangle: usize, vertex: u32, vertices: usize },
    /// The mesh is larger than any tool: its units are probably not mm.
    #[error("the mesh spans {span_mm} mm, more than {} mm: are its units millimetres?", Mesh::SPAN_MAX_MM)]
    Huge { span_mm: f64 },
}

impl Mesh {
    /// Greatest extent along any axis.
    pub const SPAN_MAX_MM: f64 = 1000.0;

    /// Checks triangles, each by the indices of its corners, and makes a mesh of them.
    ///
    /// Triangles without area are left out, and so are vertices that no triangle names. Upright triangles stay:
    /// turned, they may be seen from below.
    ///
    /// # Errors
    /// [`MeshError`] says which vertex or triangle is wrong, or that nothing is left to press.
    pub fn new(vertices_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, MeshError> {
        if let Some(vertex) = vertices_mm.iter().position(|vertex| !vertex.iter().all(|c| c.is_finite())) {
            return Err(MeshError::NotFinite { vertex });
        }
        let mut mesh = Self {
            vertices_mm: Vec::new(),
            triangles: Vec::new(),
            bounds_mm: [[0.0; 2]; 3],
            skin: OnceLock::new(),
        };
        let mut places = vec![None; vertices_mm.len()];
        let mut seen = false;
        for (triangle, corners) in triangles.iter().enumerate() {
            let corner_mm = |vertex: u32| {
                let vertices = vertices_mm.len();
                let missing = MeshError::NoVertex { triangle, vertex, vertices };
                vertices_mm.get(vertex as usize).copied().ok_or(missing)
            };
            let [a, b, c] = *corners;
            let [from_x, from_y, from_z] = twice_areas_mm2([corner_mm(a)?, corner_mm(b)?, corner_mm(c)?]);
            if from_x == 0.0 && from_y == 0.0 && from_z == 0.0 {
                continue;
            }
            seen |= from_z != 0.0;
            mesh.triangles.push(corners.map(|vertex| {
                let place = &mut places[vertex as usize];
                *place.get_or_insert_with(|| {
                    mesh.vertices_mm.push(vertices_mm[vertex as usize]);
                    // As many as the indices given, which are `u32`.
                    u32::try_from(mesh.vertices_mm.len() - 1).unwrap_or(u32::MAX)
                })
            }));
        }
        if !seen {
            return Err(MeshError::Empty);
        }
        mesh.bounds_mm = bounds_mm(&mesh.vertices_mm);
        let span_mm = mesh.bounds_mm.iter().map(|[least, most]| most - least).fold(0.0, f64::max);
        if span_mm > Self::SPAN_MAX_MM {
            return Err(MeshError::Huge { span_mm });
        }
        Ok(mesh)
    }

    /// The vertices, in mm, tool frame.
    pub fn vertices_mm(&self) -> &[[f64; 3]] {
        &self.vertices_mm
    }

    /// The triangles, each by the indices of its corners.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corners of every triangle, in mm, tool frame.
    pub fn corners_mm(&self) -> impl Iterator<Item = [[f64; 3]; 3]> {
        self.triangles.iter().map(|corners| corners.map(|vertex| self.vertices_mm[vertex as usize]))
    }

    /// Least and greatest x, y and z.
    pub fn bounds_mm(&self) -> [[f64; 2]; 3] {
        self.bounds_mm
    }

    /// The mesh as the skin of a solid, if it is one.
    pub(crate) fn skin(&self) -> Option<&Skin> {
        self.skin.get_or_init(|| Skin::of(self)).as_ref()
    }

    /// The tool with another attitude: every vertex multiplied by `rotation`, row by row.
    ///
    /// # Errors
    /// [`MeshError::Empty`] if no triangle can be seen from below any more, [`MeshError::NotFinite`] if
    /// `rotation` is not.
    pub fn turned(&self, rotation: [[f64; 3]; 3]) -> Result<Self, MeshError> {
        let turn = |[x, y, z]: [f64; 3]| rotation.map(|[a, b, c]| a * x + b * y + c * z);
        let turned: Vec<_> = self.vertices_mm.iter().copied().map(turn).collect();
        Self::new(&turned, &self.triangles)
    }
}

/// Twice the area of a triangle as seen along x, y and z.
fn twice_areas_mm2([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    [(1, 2), (2, 0), (0, 1)].map(|(u, v)| (b[u] - a[u]) * (c[v] - a[v]) - (c[u] - a[u]) * (b[v] - a[v]))
}

fn bounds_mm(vertices_mm: &[[f64; 3]]) -> [[f64; 2]; 3] {
    let none = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    vertices_mm.iter().fold(none, |bounds, vertex| {
        std::array::from_fn(|axis| {
            let [least, most]: [f64; 2] = bounds[axis];
            [least.min(vertex[axis]), most.max(vertex[axis])]
        })
    })
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
