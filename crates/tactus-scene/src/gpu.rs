//! Images by compute shaders.

use std::collections::VecDeque;
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::cast_slice;
use rayon::prelude::*;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, PollType};

use crate::facet::{Facet, STEPS};
use crate::lattice::{Axis, single};
use crate::{Pose, RenderError, Renderer};

/// Why the GPU makes no images.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// The same error as on the CPU.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// There is no GPU, or it has no driver.
    #[error(
        "no Vulkan device: install its driver (mesa-vulkan-drivers has one for most, and one in software), or use \
         the CPU path, which gives the same images"
    )]
    NoAdapter {
        /// What was tried.
        source: wgpu::RequestAdapterError,
    },
    /// The driver refused to open the device.
    #[error("{adapter} cannot be opened")]
    Open {
        /// Name of the adapter.
        adapter: String,
        /// Why.
        source: wgpu::RequestDeviceError,
    },
    /// A single pose exceeds the limits of the device.
    #[error(
        "a pose needs {wanted} {what}, and {adapter} takes {most}: make the cells larger or the mesh coarser"
    )]
    TooLarge {
        /// Name of the adapter.
        adapter: String,
        /// Bytes or workgroups.
        what: &'static str,
        /// How many.
        wanted: u64,
        /// Most that it takes.
        most: u64,
    },
    /// The device failed, such as when its memory ran out.
    #[error("{adapter} failed: {reason}")]
    Failed {
        /// Name of the adapter.
        adapter: String,
        /// In its driver's words.
        reason: String,
    },
}

/// Most bytes of a buffer: enough to keep a large device busy with one batch.
const BUFFER_BYTES_MAX: u64 = 128 << 20;

/// Batches under way: while the device computes one, the processor prepares the next.
const SLOTS: usize = 2;

/// Sides of the tiles and sizes of the workgroups that the shaders state.
const TILE: u32 = 8;
const GROUP: u32 = 64;

/// A pose's part of the buffers and of the lattice, as the shaders read it.
type View = [u32; 6];

/// A [`Facet`] as the shaders read it.
type Words = [u32; 16];

/// A [`Renderer`] by compute shaders through Vulkan, for many poses at once.
///
/// The CPU turns the tool and cuts it into facets, in double precision and then in integers. The GPU draws, blurs,
/// integrates and applies the response in single precision. Both draw the same integers, so their images differ by rounding
/// only: by less than 1e-5 of the peak, measured 1.3e-6 (`tests/it/gpu.rs` prints it).
///
/// A call may have any number of poses; thousands at a time keep a device busy.
#[derive(Debug)]
pub struct GpuRenderer {
    renderer: Renderer,
    adapter: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// Errors that the device reported asynchronously.
    failure: Arc<Mutex<Option<String>>>,
    room: Room,
    stages: Stages,
    slots: Vec<Slot>,
}

/// What one pose may need.
#[derive(Debug, Clone, Copy)]
struct Room {
    facets: u64,
    cells: u64,
    lines: u64,
    elements: u64,
    /// Workgroups of each stage.
    groups: [u32; 3],
    /// Poses that fit the buffers of a batch.
    poses_max: u64,
}

/// The three shaders, and what they read that is the same for all poses.
#[derive(Debug)]
struct Stages {
    pipelines: [wgpu::ComputePipeline; 3],
    batch: wgpu::Buffer,
    /// Shares and reaches, of the columns and of the rows.
    axes: [[wgpu::Buffer; 2]; 2],
    responses: wgpu::Buffer,
}

/// Buffers of a batch.
#[derive(Debug)]
struct Slot {
    poses: u64,
    views: wgpu::Buffer,
    facets: wgpu::Buffer,
    counts: wgpu::Buffer,
    /// Where the processor may read the counts.
    read_back: wgpu::Buffer,
    /// Of each stage.
    bindings: [wgpu::BindGroup; 3],
}

/// A batch under way.
struct Batch<'a> {
    slot: Slot,
    submission: wgpu::SubmissionIndex,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
    counts: &'a mut [f32],
}

impl GpuRenderer {
    /// Opens the fastest device of this machine for a renderer's images.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] without device or driver, [`GpuError::Open`] if the driver refuses,
    /// [`GpuError::TooLarge`] if one pose is more than the device takes.
    pub fn new(renderer: Renderer) -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|source| GpuError::NoAdapter { source })?;
        let name = adapter.get_info().name;
        let limits = adapter.limits();
        let room = Room::of(&renderer, &limits, &name)?;
        let wanted = wgpu::DeviceDescriptor { required_limits: limits, ..wgpu::DeviceDescriptor::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted))
            .map_err(|source| GpuError::Open { adapter: name.clone(), source })?;
        let failure = Arc::new(Mutex::new(None));
        let reported = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            reported.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error.to_string());
        }));
        let stages = Stages::new(&device, &renderer, room);
        let made = Self { renderer, adapter: name, device, queue, failure, room, stages, slots: Vec::new() };
        made.reported()?;
        Ok(made)
    }

    /// Name of the device: of one in software, `llvmpipe` and its version.
    pub fn adapter(&self) -> &str {
        &self.adapter
    }

    /// The renderer whose images these are.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Counts of every element of every pose, one image after the other, as [`Renderer::images`] makes them.
    ///
    /// # Errors
    /// [`GpuError::Render`] as there, [`GpuError::Failed`] if the device does.
    pub fn images(&mut self, poses: &[Pose], counts: &mut [f32]) -> Result<(), GpuError> {
        self.renderer.check(poses, counts)?;
        let most = usize::try_from(self.room.poses_max).unwrap_or(usize::MAX);
        let elements = self.renderer.model().array().elements();
        let mut under_way = VecDeque::new();
        for (poses, counts) in poses.chunks(most).zip(counts.chunks_mut(most * elements)) {
            let drawn = self.draw(poses);
            if under_way.len() == SLOTS
                && let Some(batch) = under_way.pop_front()
            {
                self.collect(batch)?;
            }
            under_way.push_back(self.submit(poses.len() as u64, drawn, counts));
        }
        under_way.into_iter().try_for_each(|batch| self.collect(batch))
    }

    /// The views and facets of poses, in several parts.
    fn draw(&self, poses: &[Pose]) -> Vec<(Vec<View>, Vec<Words>)> {
        let share = poses.len().div_ceil(rayon::current_num_threads()).max(1);
        let draw = |poses: &[Pose]| {
            let (mut placed, mut facets) = (Vec::new(), Vec::new());
            let (mut views, mut words) = (Vec::new(), Vec::new());
            for pose in poses {
                let window = self.renderer.facets(pose, &mut placed, &mut facets);
                let [[left, front], [cols, rows]] = [window.first, window.cells].map(|cells| cells.map(word));
                views.push([word(words.len()), word(facets.len()), left, front, cols, rows]);
                words.extend(facets.iter().map(Facet::words));
            }
            (views, words)
        };
        poses.par_chunks(share).map(draw).collect()
    }

    fn submit<'a>(
        &mut self,
        poses: u64,
        drawn: Vec<(Vec<View>, Vec<Words>)>,
        counts: &'a mut [f32],
    ) -> Batch<'a> {
        let slot = match self.slots.pop() {
            Some(slot) if slot.poses >= poses => slot,
            _ => Slot::new(&self.device, &self.stages, self.room, poses),
        };
        let (mut first_view, mut first_facet) = (0, 0);
        for (mut views, facets) in drawn {
            for view in &mut views {
                view[0] += word(first_facet);
            }
            self.queue.write_buffer(&slot.views, bytes::<View>(first_view as u64), cast_slice(&views));
            self.queue.write_buffer(&slot.facets, bytes::<Words>(first_facet as u64), cast_slice(&facets));
            first_view += views.len();
            first_facet += facets.len();
        }
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        for ((pipeline, binding), groups) in
            self.stages.pipelines.iter().zip(&slot.bindings).zip(self.room.groups)
        {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, binding, &[]);
            // At most `poses_max`.
            pass.dispatch_workgroups(groups, u32::try_from(poses).unwrap_or(u32::MAX), 1);
        }
        drop(pass);
        let read = bytes::<f32>(poses * self.room.elements);
        encoder.copy_buffer_to_buffer(&slot.counts, 0, &slot.read_back, 0, read);
        let submission = self.queue.submit([encoder.finish()]);
        let (mapping, mapped) = mpsc::channel();
        slot.read_back.map_async(wgpu::MapMode::Read, ..read, move |result| {
            // Whoever waited is gone if this fails.
            drop(mapping.send(result));
        });
        Batch { slot, submission, mapped, counts }
    }

    /// Waits for a batch and takes its counts.
    fn collect(&mut self, batch: Batch<'_>) -> Result<(), GpuError> {
        let Batch { slot, submission, mapped, counts } = batch;
        let waited = self.device.poll(PollType::Wait { submission_index: Some(submission), timeout: None });
        self.reported()?;
        waited.map_err(|error| self.failed(&error))?;
        mapped.recv().map_err(|error| self.failed(&error))?.map_err(|error| self.failed(&error))?;
        let read = bytes::<f32>(counts.len() as u64);
        let mapped = slot.read_back.get_mapped_range(..read).map_err(|error| self.failed(&error))?;
        counts.copy_from_slice(cast_slice(&mapped));
        drop(mapped);
        slot.read_back.unmap();
        self.slots.push(slot);
        Ok(())
    }

    /// An error that the device reported asynchronously.
    fn reported(&self) -> Result<(), GpuError> {
        match self.failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(reason) => Err(self.failed(&reason)),
            None => Ok(()),
        }
    }

    fn failed(&self, reason: &impl ToString) -> GpuError {
        GpuError::Failed { adapter: self.adapter.clone(), reason: reason.to_string() }
    }
}

impl Room {
    fn of(renderer: &Renderer, limits: &wgpu::Limits, adapter: &str) -> Result<Self, GpuError> {
        let array = renderer.model().array();
        let [cols, rows] = renderer.window_max().map(|cells| cells as u64);
        let (facets, cells) = (renderer.mesh.triangles().len() as u64, cols * rows);
        let (lines, elements) = (rows * array.cols() as u64, array.elements() as u64);
        let tiles = cols.div_ceil(TILE.into()) * rows.div_ceil(TILE.into());
        let wanted = [tiles, lines.div_ceil(GROUP.into()), elements.div_ceil(GROUP.into())];

        let too_large =
            |what, wanted, most| GpuError::TooLarge { adapter: adapter.into(), what, wanted, most };
        let along_max = u64::from(limits.max_compute_workgroups_per_dimension);
        if let Some(wanted) = wanted.into_iter().find(|wanted| *wanted > along_max) {
            return Err(too_large("workgroups", wanted, along_max));
        }
        let pose = bytes::<Words>(facets).max(bytes::<f32>(cells.max(lines).max(elements)));
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if pose > most {
            return Err(too_large("bytes in one buffer", pose, most));
        }
        let poses_max = (BUFFER_BYTES_MAX.min(most) / pose).clamp(1, along_max);
        let groups = wanted.map(|groups| u32::try_from(groups).unwrap_or(u32::MAX));
        Ok(Self { facets, cells, lines, elements, groups, poses_max })
    }
}

impl Stages {
    fn new(device: &wgpu::Device, renderer: &Renderer, room: Room) -> Self {
        let read_only = |contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let array = renderer.model().array();
        let [[xx, xy], [yx, yy]] = STEPS.map(|steps| steps.map(word));
        let [cells, lines] = [room.cells, room.lines].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        let batch = [word(array.cols()), word(array.rows()), cells, lines, xx, xy, yx, yy];
        let of_axis = |axis: &Axis| {
            let reaches: Vec<_> =
                axis.reaches().flat_map(|reach| [word(reach.start), word(reach.end)]).collect();
            [
                read_only(cast_slice(&axis.by_cell_mm()), BufferUsages::STORAGE),
                read_only(cast_slice(&reaches), BufferUsages::STORAGE),
            ]
        };
        let response = renderer.model().response();
        let per_reference_mm2 = 1.0 / renderer.model().reference_mm2();
        let responses = (0..array.elements()).flat_map(|element| {
            [
                response.baseline_counts[element],
                response.sensitivity_counts_per_mm[element],
                response.quadratic_per_mm[element],
                per_reference_mm2,
            ]
        });
        let responses: Vec<f32> = responses.map(single).collect();
        Self {
            pipelines: [
                concat!(include_str!("gpu/batch.wgsl"), include_str!("gpu/depth.wgsl")),
                concat!(include_str!("gpu/batch.wgsl"), include_str!("gpu/columns.wgsl")),
                concat!(include_str!("gpu/batch.wgsl"), include_str!("gpu/elements.wgsl")),
            ]
            .map(|source| pipeline(device, source)),
            batch: read_only(cast_slice(&batch), BufferUsages::UNIFORM),
            axes: renderer.lattice.axes.each_ref().map(of_axis),
            responses: read_only(cast_slice(&responses), BufferUsages::STORAGE),
        }
    }
}

impl Slot {
    fn new(device: &wgpu::Device, stages: &Stages, room: Room, poses: u64) -> Self {
        let buffer = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let written = |size| buffer(size, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let views = written(bytes::<View>(poses));
        let facets = written(bytes::<Words>(poses * room.facets));
        let depths = buffer(bytes::<f32>(poses * room.cells), BufferUsages::STORAGE);
        let lines = buffer(bytes::<f32>(poses * room.lines), BufferUsages::STORAGE);
        let size = bytes::<f32>(poses * room.elements);
        let counts = buffer(size, BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let read_back = buffer(size, BufferUsages::MAP_READ | BufferUsages::COPY_DST);

        let [[of_cols, cols_reach], [of_rows, rows_reach]] = &stages.axes;
        let [depth, columns, elements] = &stages.pipelines;
        let bindings = [
            bind(device, depth, &[&stages.batch, &views, &facets, &depths]),
            bind(device, columns, &[&stages.batch, &views, &depths, of_cols, cols_reach, &lines]),
            bind(
                device,
                elements,
                &[&stages.batch, &views, &lines, of_rows, rows_reach, &stages.responses, &counts],
            ),
        ];
        Self { poses, views, facets, counts, read_back, bindings }
    }
}

fn pipeline(device: &wgpu::Device, source: &str) -> wgpu::ComputePipeline {
    let source = wgpu::ShaderSource::Wgsl(source.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// Binds buffers to a stage in the order of its bindings.
fn bind(
    device: &wgpu::Device,
    pipeline: &wgpu::ComputePipeline,
    buffers: &[&wgpu::Buffer],
) -> wgpu::BindGroup {
    let entries: Vec<_> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    let layout = &pipeline.get_bind_group_layout(0);
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Bytes of a number of values.
fn bytes<T>(values: u64) -> u64 {
    values * size_of::<T>() as u64
}

/// An index or count within a buffer, which holds less than 2^32 values.
fn word(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}
