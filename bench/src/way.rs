//! The ways from a pose to an image.

use std::sync::Arc;

use anyhow::{Result, bail};
use tactus_model::{Contact, ForwardModel, Indenter, PressTable};
use tactus_scene::{Attitude, Renderer};

use crate::{COVERING, DEPTH_MAX_MM, Pose};

/// How an image comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Way {
    /// [`PressTable`]: the tool's blurred and integrated footprint, tabulated once.
    PressTable,
    /// [`Renderer`]: the mesh drawn into a depth map, then two matrix products; any attitude.
    Raster,
    /// [`ForwardModel::image`]: closed forms and quadrature; the reference.
    Exact,
}

/// Makes images of one tool along one way, with the memory it needs; every thread has its own.
#[derive(Debug, Clone)]
pub enum Painter {
    /// See [`Way::PressTable`].
    PressTable(PressTable),
    /// See [`Way::Raster`].
    Raster(Renderer),
    /// See [`Way::Exact`].
    Exact {
        /// The model.
        model: ForwardModel,
        /// The tool, at the last pose.
        contact: Contact,
        /// The last image.
        counts: Vec<f64>,
    },
}

impl Painter {
    /// What can be made ready before the first pose is known.
    ///
    /// # Errors
    /// If the blur is too fine for a press table, or a tool without a mesh is to be drawn.
    pub fn new(way: Way, model: &ForwardModel, indenter: &Indenter) -> Result<Self> {
        Ok(match way {
            Way::PressTable => Self::PressTable(PressTable::new(model, indenter, COVERING, DEPTH_MAX_MM)?),
            Way::Raster => {
                let Indenter::Mesh(mesh) = indenter else {
                    bail!("only a mesh is drawn: {indenter:?} is none")
                };
                Self::Raster(Renderer::new(model.clone(), COVERING, Arc::clone(mesh))?)
            }
            Way::Exact => Self::Exact {
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

    /// From a pose to the counts of every element: depth, blur, integration, response.
    ///
    /// # Errors
    /// If the pose is deeper than [`DEPTH_MAX_MM`] or `image` has not one place per element.
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
