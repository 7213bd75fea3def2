//! A tool in the rig file and the model file. The file contains a mesh itself, so that data are self-contained.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tactus_model::{Indenter, Mesh};

use super::{WrongField, positive, wrong};

/// A tool: its shape, and the size that goes with it. Not a tagged enum, for the reason given at [`OneOrEach`].
///
/// [`OneOrEach`]: super::OneOrEach
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawIndenter {
    /// `"cylinder"`, `"sphere"`, `"cone"`, `"box"` or `"mesh"`.
    shape: Shape,
    /// Diameter of a cylinder, sphere or cone.
    #[serde(skip_serializing_if = "Option::is_none")]
    diameter_mm: Option<f64>,
    /// Full angle at a cone's tip.
    #[serde(skip_serializing_if = "Option::is_none")]
    apex_deg: Option<f64>,
    /// Sides of a box along x and y.
    #[serde(skip_serializing_if = "Option::is_none")]
    size_mm: Option<[f64; 2]>,
    /// Vertices of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    vertices_mm: Option<Vec<[f64; 3]>>,
    /// Triangles of a mesh: three indices of vertices each.
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<Vec<[u32; 3]>>,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Shape {
    Cylinder,
    Sphere,
    Cone,
    Box,
    Mesh,
}

impl RawIndenter {
    pub(crate) fn of(tool: &Indenter) -> Self {
        let raw = |shape| Self {
            shape,
            diameter_mm: None,
            apex_deg: None,
            size_mm: None,
            vertices_mm: None,
            triangles: None,
        };
        match tool {
            Indenter::Cylinder { diameter_mm } => {
                Self { diameter_mm: Some(*diameter_mm), ..raw(Shape::Cylinder) }
            }
            Indenter::Sphere { diameter_mm } => {
                Self { diameter_mm: Some(*diameter_mm), ..raw(Shape::Sphere) }
            }
            Indenter::Cone { diameter_mm, apex_deg } => {
                Self { diameter_mm: Some(*diameter_mm), apex_deg: Some(*apex_deg), ..raw(Shape::Cone) }
            }
            Indenter::Box { size_mm } => Self { size_mm: Some(*size_mm), ..raw(Shape::Box) },
            Indenter::Mesh(mesh) => Self {
                vertices_mm: Some(mesh.vertices_mm().to_vec()),
                triangles: Some(mesh.triangles().to_vec()),
                ..raw(Shape::Mesh)
            },
        }
    }

    pub(crate) fn check(&self, field: &str) -> Result<Indenter, WrongField> {
        let field = |name: &str| format!("{field}.{name}");
        let diameter = |diameter_mm| positive(field("diameter_mm"), diameter_mm);
        let Self { shape, diameter_mm, apex_deg, size_mm, vertices_mm, triangles } = self;
        match (shape, *diameter_mm, *apex_deg, *size_mm, vertices_mm, triangles) {
            (Shape::Cylinder, Some(diameter_mm), None, None, None, None) => {
                Ok(Indenter::Cylinder { diameter_mm: diameter(diameter_mm)? })
            }
            (Shape::Sphere, Some(diameter_mm), None, None, None, None) => {
                Ok(Indenter::Sphere { diameter_mm: diameter(diameter_mm)? })
            }
            (Shape::Cone, Some(diameter_mm), Some(apex_deg), None, None, None) => {
                if !(apex_deg > 0.0 && apex_deg < 180.0) {
                    return Err(wrong(field("apex_deg"), "the full angle at the tip lies between 0 and 180"));
                }
                Ok(Indenter::Cone { diameter_mm: diameter(diameter_mm)?, apex_deg })
            }
            (Shape::Box, None, None, Some([x, y]), None, None) => Ok(Indenter::Box {
                size_mm: [positive(field("size_mm[0]"), x)?, positive(field("size_mm[1]"), y)?],
            }),
            (Shape::Mesh, None, None, None, Some(vertices_mm), Some(triangles)) => {
                let mesh = Mesh::new(vertices_mm, triangles);
                Ok(Indenter::Mesh(Arc::new(
                    mesh.map_err(|error| wrong(field("triangles"), error.to_string()))?,
                )))
            }
            (shape, ..) => Err(wrong(
                field("shape"),
                match shape {
                    Shape::Cylinder | Shape::Sphere => "this shape has a diameter_mm and nothing else",
                    Shape::Cone => "this shape has a diameter_mm and an apex_deg and nothing else",
                    Shape::Box => "this shape has a size_mm = [x, y] and nothing else",
                    Shape::Mesh => "this shape has vertices_mm and triangles and nothing else",
                },
            )),
        }
    }
}

#[cfg(test)]
#[path = "indenter_tests.rs"]
mod tests;
