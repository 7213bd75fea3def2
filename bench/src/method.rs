//! The methods from a pose to an image.

use std::sync::Arc;

use anyhow::{Result, bail};
use tactus_model::{Contact, ForwardModel, Indenter, PressTable};
use tactus_scene::{Attitude, Renderer};

use crate::{COVERING, DEPTH_MAX_MM, Pose};

/// How an image is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Method {
    /// [`PressTable`]: samples a table of the tool's blurred and integrated footprint, which is made once.
    PressTable,
    /// [`Renderer`]: draws the mesh into a depth map, then takes two matrix products; any attitude.
    Raster,
    /// [`ForwardModel::image`]: closed forms and quadrature; the reference.
    Exact,
}

/// Makes images of one tool by one method, and owns the memory for it; each thread has its own.
#[derive(Debug, Clone)]
pub enum Painter {
    /// See [`Method::PressTable`].
    PressTable(PressTable),
    /// See [`Method::Raster`].
    Raster(Renderer),
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
            Method::Raster => {
                let Indenter::Mesh(mesh) = indenter else {
                    bail!("the method `raster` needs a mesh, not {indenter:?}")
                };
                Self::Raster(Renderer::new(model.clone(), COVERING, Arc::clone(mesh))?)
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
            Self::Raster(renderer) => {
                let attitude = Attitude::upright(rotation_deg);
                renderer.image(&tactus_scene::Pose { position_mm, attitude, depth_mm }, image)?;
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
