//! From poses of a tool to the counts of every element.

use std::sync::Arc;

use rayon::prelude::*;
use tactus_model::{Covering, ForwardModel, Mesh, MeshImages};

use crate::Pose;
use crate::depth::{self, DepthMap};
use crate::facet::{self, Facet, Placed, SAMPLES, Window};
#[cfg(feature = "gpu")]
use crate::lattice::whole;
use crate::lattice::{Lattice, single};

/// Default number of cells per `sigma` of the blur.
const CELLS_PER_SIGMA: f64 = 16.0;

/// Default least and greatest number of cells along a tool.
const CELLS_PER_TOOL: [f64; 2] = [64.0, 250.0];

/// Why no image can be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum RenderError {
    /// The covering has no thickness or no spread.
    #[error("{field} must be positive and finite, not {value} mm")]
    Covering { field: &'static str, value: f64 },
    /// The cells are not positive, or too many to cover the array.
    #[error("cells must measure at least {least_mm} mm, not {cell_mm} mm")]
    Cell {
        cell_mm: f64,
        /// Least side of a cell for this array and blur.
        least_mm: f64,
    },
    /// A value of a pose is not a finite number.
    #[error("{field} of pose {pose} is not finite")]
    Pose { pose: usize, field: &'static str },
    /// The output does not have one value for each element of each pose.
    #[error("{poses} poses of {elements} elements need {} places, not {places}", poses * elements)]
    Length { poses: usize, elements: usize, places: usize },
}

/// An orthographic camera that looks up at a tool through the covering (paper, Sec. 5), and the sensor behind it.
///
/// ```text
/// I        = z-buffer of the tool's depth below the surface, in [0, covering thickness]
/// d_e      = sum over cells i, j of I_ij * A_y[row, j] * A_x[col, i]           mm^3
/// counts_e = baseline_e + sensitivity_e * (u_e + k_e u_e^2),   u_e = d_e / d_ref
/// ```
///
/// `A` is the length of a cell that arrives in a column (or row) of elements after the blur. The viewing volume is the
/// covering. The tool can have any attitude. The mesh need not be closed, and the order of corners does not matter.
///
/// The images of a closed mesh need no raster: they follow from the edges at which the depth ends or bends ([`MeshImages`]), thirty times
/// as fast and within 3e-4 of the peak. [`Renderer::image`] makes them so where it can, and by the raster otherwise: where the mesh is
/// open, where it passes through itself, and where much of it is hidden below the surface. [`Renderer::raster_images`] always uses the
/// raster, as the GPU does.
///
/// # Accuracy of the raster
///
/// The edges of the tool are resolved by 16 samples per cell, so the error depends on the number of cells that the
/// tool touches. Compared with [`ForwardModel::image`], which has no raster, no element differs by more than
///
/// ```text
/// error <= 2 N^(-3/4) of the image's peak,   N = min(cells that the tool touches, 4 pi (sigma / cell)^2)
/// ```
///
/// The second term is about the number of cells under the blur: 3200 with the default cells. Most poses are far
/// below the bound. `tests/it/random_poses.rs` checks it with 402 random poses of the made tools and of a cylinder, a
/// sphere, a cone and a box, two thirds of them tilted:
///
/// | cells touched | poses that differ by more than 1e-3 of the peak | worst |
/// |---|---|---|
/// | 1000 or more | 3 of 219 | 6.3e-3 |
/// | 100 to 999 | 18 of 106 | 3.2e-3 |
/// | 10 to 99 | 45 of 64 | 3.3e-2 |
/// | fewer | all 13 | 8.8e-2 |
///
/// The worst poses with many cells have long edges in a direction in which the samples line up, such as 2.7 degrees
/// from the y axis. A contact that is smaller than a quarter of a cell can be missed. Smaller cells
/// ([`Renderer::with_cell_mm`]) reduce the error with the power 1.5 of their side.
#[derive(Debug, Clone)]
pub struct Renderer {
    pub(crate) model: ForwardModel,
    pub(crate) mesh: Arc<Mesh>,
    pub(crate) lattice: Lattice,
    foot_mm: f64,
    /// For a closed mesh.
    outlines: Option<MeshImages>,
}

/// Memory that a thread reuses from pose to pose.
#[derive(Default)]
struct Buffers {
    outlines: Option<MeshImages>,
    placed: Placed,
    facets: Vec<Facet>,
    samples_mm: Vec<[f32; SAMPLES]>,
    depths_mm: Vec<f32>,
}

impl Renderer {
    /// A camera with cells of `sigma / 16`. The cells are smaller if the upright tool would have fewer than 64 of them
    /// across, and larger if the tool in any attitude could have more than 250 within the raster.
    ///
    /// # Errors
    /// [`RenderError::Covering`] for a covering without thickness or spread.
    pub fn new(model: ForwardModel, covering: Covering, mesh: Arc<Mesh>) -> Result<Self, RenderError> {
        let sigma_mm = model.psf().sigma_mm(covering);
        let [fewest, most] = CELLS_PER_TOOL;
        let [x_mm, y_mm, z_mm] = mesh.bounds_mm().map(|[least, most]| most - least);
        let raster_mm = Lattice::spans_mm(model.array(), sigma_mm).into_iter().fold(0.0, f64::max);
        let coarsest_mm = (sigma_mm / CELLS_PER_SIGMA).min(x_mm.hypot(y_mm) / fewest);
        let finest_mm = x_mm.hypot(y_mm).hypot(z_mm).min(raster_mm) / most;
        Self::with_cell_mm(model, covering, mesh, coarsest_mm.max(finest_mm))
    }

    /// A camera with cells of a given size. Time grows with the inverse square of the size.
    ///
    /// # Errors
    /// [`RenderError::Covering`] for a covering without thickness or spread, [`RenderError::Cell`] for cells
    /// that are not positive or too many.
    pub fn with_cell_mm(
        model: ForwardModel,
        covering: Covering,
        mesh: Arc<Mesh>,
        cell_mm: f64,
    ) -> Result<Self, RenderError> {
        let sigma_mm = model.psf().sigma_mm(covering);
        for (field, value) in [("covering thickness", covering.thickness_mm), ("sigma", sigma_mm)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(RenderError::Covering { field, value });
            }
        }
        let lattice = Lattice::new(model.array(), sigma_mm, cell_mm)?;
        let outlines = MeshImages::new(&model, Arc::clone(&mesh), covering);
        Ok(Self { model, mesh, lattice, foot_mm: covering.thickness_mm, outlines })
    }

    /// The model whose counts the images hold.
    pub fn model(&self) -> &ForwardModel {
        &self.model
    }

    /// Side of a cell.
    pub fn cell_mm(&self) -> f64 {
        self.lattice.cell_mm
    }

    /// The depth map of a pose.
    ///
    /// # Errors
    /// [`RenderError::Pose`] if the pose is not finite.
    pub fn depth_map(&self, pose: &Pose) -> Result<DepthMap, RenderError> {
        check(std::slice::from_ref(pose))?;
        let mut facets = Vec::new();
        let window = self.facets(pose, &mut Vec::new(), &mut facets);
        Ok(DepthMap::new(&self.lattice, window, &facets))
    }

    /// Counts of every element of a pose, before noise, saturation and quantisation; row-major, overwritten.
    ///
    /// # Errors
    /// [`RenderError::Pose`] if the pose is not finite, [`RenderError::Length`] if `counts` does not have one value per
    /// element.
    pub fn image(&self, pose: &Pose, counts: &mut [f32]) -> Result<(), RenderError> {
        let poses = std::slice::from_ref(pose);
        self.check(poses, counts)?;
        self.render(&mut self.buffers(), pose, counts);
        Ok(())
    }

    /// Counts of every element of every pose, one image after the other.
    ///
    /// Runs on rayon's current thread pool: one thread per core, `RAYON_NUM_THREADS` of them, or those of the pool in
    /// whose `install` it is called. The images do not depend on the number of threads.
    ///
    /// # Errors
    /// As of [`Renderer::image`].
    pub fn images(&self, poses: &[Pose], counts: &mut [f32]) -> Result<(), RenderError> {
        self.images_with(|| self.buffers(), poses, counts)
    }

    /// As [`Renderer::images`], always by the raster.
    ///
    /// # Errors
    /// As of [`Renderer::image`].
    pub fn raster_images(&self, poses: &[Pose], counts: &mut [f32]) -> Result<(), RenderError> {
        self.images_with(Buffers::default, poses, counts)
    }

    fn images_with(
        &self,
        buffers: impl Fn() -> Buffers + Sync + Send,
        poses: &[Pose],
        counts: &mut [f32],
    ) -> Result<(), RenderError> {
        self.check(poses, counts)?;
        let elements = self.model.array().elements();
        poses
            .par_iter()
            .zip(counts.par_chunks_exact_mut(elements))
            .for_each_init(buffers, |buffers, (pose, counts)| self.render(buffers, pose, counts));
        Ok(())
    }

    fn buffers(&self) -> Buffers {
        Buffers { outlines: self.outlines.clone(), ..Buffers::default() }
    }

    pub(crate) fn check(&self, poses: &[Pose], counts: &[f32]) -> Result<(), RenderError> {
        let elements = self.model.array().elements();
        if poses.len() * elements != counts.len() {
            return Err(RenderError::Length { poses: poses.len(), elements, places: counts.len() });
        }
        check(poses)
    }

    /// Most columns and rows of cells that a pose can reach.
    #[cfg(feature = "gpu")]
    pub(crate) fn window_max(&self) -> [usize; 2] {
        let [x_mm, y_mm, z_mm] = self.mesh.bounds_mm().map(|[least, most]| most - least);
        let tool = whole(x_mm.hypot(y_mm).hypot(z_mm) / self.lattice.cell_mm) + 3;
        self.lattice.axes.each_ref().map(|axis| axis.cells.min(tool))
    }

    pub(crate) fn facets(&self, pose: &Pose, placed: &mut Placed, facets: &mut Vec<Facet>) -> Window {
        facet::facets(&self.mesh, pose, &self.lattice, self.foot_mm, placed, facets)
    }

    /// Image of a pose that was checked.
    fn render(&self, buffers: &mut Buffers, pose: &Pose, counts: &mut [f32]) {
        let Buffers { outlines, placed, facets, samples_mm, depths_mm } = buffers;
        let Pose { position_mm, attitude, depth_mm } = *pose;
        if let Some(outlines) = outlines
            && outlines.image(position_mm, attitude.matrix(), depth_mm, counts)
        {
            return;
        }
        let window = self.facets(pose, placed, facets);
        depth::draw(window, facets, samples_mm, depths_mm);
        self.integrate(window, depths_mm, counts);
        self.respond(counts);
    }

    /// `u_e` of every element: the blur and the elements' areas, along x and then along y.
    fn integrate(&self, window: Window, depths_mm: &[f32], indentation_mm: &mut [f32]) {
        indentation_mm.fill(0.0);
        let [cols, rows] = window.cells;
        if rows == 0 {
            return;
        }
        let [x, y] = &self.lattice.axes;
        let of_cols: Vec<_> = x.shares_mm(window.first[0], cols).collect();
        let of_rows: Vec<_> = y.shares_mm(window.first[1], rows).collect();
        let scale = single(1.0 / self.model.reference_mm2());
        let mut line = vec![0.0; of_cols.len()];
        for (row, depths_mm) in depths_mm.chunks_exact(cols).enumerate() {
            for (arrived, (reach, shares_mm)) in line.iter_mut().zip(&of_cols) {
                *arrived = scale * dot(shares_mm, &depths_mm[reach.clone()]);
            }
            for (elements, (reach, shares_mm)) in indentation_mm.chunks_exact_mut(line.len()).zip(&of_rows) {
                if reach.contains(&row) {
                    let share_mm = shares_mm[row - reach.start];
                    for (element, arrived) in elements.iter_mut().zip(&line) {
                        *element += share_mm * arrived;
                    }
                }
            }
        }
    }

    /// Counts from `u_e`, as [`ForwardModel::respond`] makes them.
    fn respond(&self, values: &mut [f32]) {
        let response = self.model.response();
        for (element, value) in values.iter_mut().enumerate() {
            *value = single(response.counts(element, f64::from(*value)));
        }
    }
}

fn check(poses: &[Pose]) -> Result<(), RenderError> {
    for (pose, Pose { position_mm, attitude, depth_mm }) in poses.iter().enumerate() {
        let angles = [attitude.yaw_deg, attitude.pitch_deg, attitude.roll_deg];
        let fields = [("position", &position_mm[..]), ("attitude", &angles), ("depth", &[*depth_mm])];
        if let Some((field, _)) = fields.into_iter().find(|(_, values)| !values.iter().all(|v| v.is_finite()))
        {
            return Err(RenderError::Pose { pose, field });
        }
    }
    Ok(())
}

/// Sum of products, in sixteen parallel sums.
fn dot(one: &[f32], other: &[f32]) -> f32 {
    let (ones, one) = one.as_chunks::<16>();
    let (others, other) = other.as_chunks::<16>();
    let mut sums = [0.0; 16];
    for (one, other) in ones.iter().zip(others) {
        for ((sum, a), b) in sums.iter_mut().zip(one).zip(other) {
            *sum += a * b;
        }
    }
    let rest: f32 = one.iter().zip(other).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

#[cfg(test)]
#[path = "image_tests.rs"]
mod tests;
