//! The methods from a pose to an image.

use std::sync::Arc;

use anyhow::{Context as _, Result, bail};
use tactus_model::{Contact, ForwardModel, Indenter, MeshImages, PressTable};
use tactus_scene::{Attitude, Renderer};

use crate::{COVERING, DEPTH_MAX_MM, Pose};

/// How an image is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// [`PressTable`]: samples a table of the tool's blurred and integrated footprint, which is made once.
    PressTable,
    /// [`MeshImages`]: integrals along the outline of a closed mesh; any attitude.
    Outline,
    /// [`Renderer::raster_images`]: draws the mesh into a depth map, then takes two matrix products; any attitude and mesh.
    Raster,
    /// [`ForwardModel::image`]: closed forms and quadrature; the reference.
    Exact,
}

/// Makes images of one tool by one method, and owns the memory for it; each thread has its own.
#[derive(Debug, Clone)]
pub enum Painter {
    /// See [`Method::PressTable`].
    PressTable(PressTable),
    /// See [`Method::Outline`].
    Outline(MeshImages),
    /// See [`Method::Raster`].
    Raster(Box<Renderer>),
    /// See [`Method::Exact`].
    Exact {
        /// The exact forward model.
        model: ForwardModel,
        /// The tool at the last pose.
        contact: Contact,
        /// The last image.
        counts: Vec<f64>,
    },
}

impl Painter {
    /// Prepares everything that does not depend on the pose.
    ///
    /// # Errors
    /// If the blur is too fine for a press table, or if the method needs a mesh and the tool has none.
    pub fn new(method: Method, model: &ForwardModel, indenter: &Indenter) -> Result<Self> {
        Ok(match method {
            Method::PressTable => Self::PressTable(PressTable::new(model, indenter, COVERING, DEPTH_MAX_MM)?),
            Method::Outline => {
                let Indenter::Mesh(mesh) = indenter else {
                    bail!("the method `outline` needs a mesh, not {indenter:?}")
                };
                let images = MeshImages::new(model, Arc::clone(mesh), COVERING);
                Self::Outline(images.context("the method `outline` needs a closed mesh")?)
            }
            Method::Raster => {
                let Indenter::Mesh(mesh) = indenter else {
                    bail!("the method `raster` needs a mesh, not {indenter:?}")
                };
                Self::Raster(Box::new(Renderer::new(model.clone(), COVERING, Arc::clone(mesh))?))
            }
            Method::Exact => Self::Exact {
                model: model.clone(),
                contact: Contact {
                    indenter: indenter.clone(),
                    position_mm: [0.0; 2],
                    rotation_deg: 0.0,
                    depth_mm: 0.0,
                },
                counts: vec![0.0; model.array().elements()],
            },
        })
    }

    /// Writes the counts of every element for a pose: depth, blur, integration, response.
    ///
    /// # Errors
    /// If the pose is deeper than [`DEPTH_MAX_MM`], or if `image` does not have one place for each element.
    pub fn image(&mut self, pose: &Pose, image: &mut [f32]) -> Result<()> {
        let Pose { position_mm, rotation_deg, depth_mm } = *pose;
        match self {
            Self::PressTable(table) => table.image(position_mm, rotation_deg, depth_mm, image)?,
            Self::Outline(images) => {
                let rotation = Attitude::upright(rotation_deg).matrix();
                if !images.image(position_mm, rotation, depth_mm, image) {
                    bail!("too much of the tool is hidden below the surface");
                }
            }
            Self::Raster(renderer) => {
                let attitude = Attitude::upright(rotation_deg);
                renderer.raster_images(&[tactus_scene::Pose { position_mm, attitude, depth_mm }], image)?;
            }
            Self::Exact { model, contact, counts } => {
                *contact =
                    Contact { indenter: contact.indenter.clone(), position_mm, rotation_deg, depth_mm };
                model.image(contact, COVERING, counts);
                for (narrow, count) in image.iter_mut().zip(counts) {
                    *narrow = single(*count);
                }
            }
        }
        Ok(())
    }
}

#[expect(clippy::cast_possible_truncation, reason = "images are single precision")]
fn single(count: f64) -> f32 {
    count as f32
}
