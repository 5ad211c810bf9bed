//! Ray casting by a compute shader.

use super::bindings::{self, Split};
use super::{Distances, Rays};
use crate::bvh::{Bvh2Node, TriangleBlock};
use bytemuck::{Pod, Zeroable};
use pollster::block_on;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};
use thiserror::Error;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Rays per workgroup; the shader's `@workgroup_size`.
const WORKGROUP: usize = 64;

/// Bytes of a node and of a block of triangles.
const NODE: usize = size_of::<Bvh2Node>();
const BLOCK: usize = size_of::<TriangleBlock>();

/// Rays per dispatch, if the limits allow it: enough to fill a GPU, in little memory.
const DISPATCH: usize = 1 << 20;

/// Why a GPU did not cast the rays. Native code can, so that this becomes a notice.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(in crate::variance) enum GpuError {
    /// There is none, or only a software implementation where a real one is required.
    #[error("no Vulkan device was found")]
    NoAdapter,
    /// The scan does not fit into the memory that the device can address at once.
    #[error("the scan needs {bytes} bytes, but {adapter} addresses at most {limit} at once")]
    TooLarge {
        /// The device's name.
        adapter: String,
        /// Bytes needed.
        bytes: u64,
        /// Bytes possible.
        limit: u64,
    },
    /// The device cannot be opened, its memory ran out, it was lost, or its driver reports an error.
    #[error("{adapter}: {message}")]
    Failed {
        /// The device's name.
        adapter: String,
        /// The reason.
        message: String,
    },
}

/// An opened GPU.
pub(in crate::variance) struct Gpu {
    name: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    /// The largest binding in bytes.
    limit: u64,
    faults: Faults,
}

/// The first error of a device, whichever way it was reported.
#[derive(Clone)]
struct Faults {
    adapter: String,
    first: Arc<Mutex<Option<String>>>,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuRay {
    origin: [f32; 3],
    present: f32,
    direction: [f32; 3],
    unused: f32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Setup {
    half_extent: [f32; 3],
    max_distance: f32,
    tolerance: f32,
    count: u32,
    facing: f32,
    cosine: f32,
    nodes_each: u32,
    blocks_each: u32,
    unused: [u32; 2],
}

/// The buffers of one run.
struct Buffers {
    setup: wgpu::Buffer,
    rays: wgpu::Buffer,
    distances: wgpu::Buffer,
    download: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    pipeline: wgpu::ComputePipeline,
    /// How the scan's arrays are split.
    nodes_split: Split,
    blocks_split: Split,
    /// Rays per dispatch.
    capacity: usize,
}

impl Gpu {
    /// Opens the best Vulkan device; a software implementation only with `or_software`.
    pub(in crate::variance) fn open(or_software: bool) -> Result<Self, GpuError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let rank = |adapter: &wgpu::Adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => Some(0),
            wgpu::DeviceType::IntegratedGpu => Some(1),
            wgpu::DeviceType::VirtualGpu => Some(2),
            wgpu::DeviceType::Other => Some(3),
            wgpu::DeviceType::Cpu => or_software.then_some(4),
        };
        let adapters = block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let best = adapters.into_iter().filter_map(|a| rank(&a).map(|r| (r, a))).min_by_key(|(r, _)| *r);
        let adapter = best.ok_or(GpuError::NoAdapter)?.1;
        let name = adapter.get_info().name;
        let descriptor = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Failed { adapter: name.clone(), message: format!("cannot be opened: {e}") })?;
        let faults = Faults { adapter: name.clone(), first: Arc::default() };
        faults.listen(&device);
        let limits = device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        Ok(Self { name, device, queue, limit, faults })
    }

    /// Pretends that no binding can hold more than `limit` bytes.
    #[cfg(test)]
    pub(super) fn with_limit(mut self, limit: u64) -> Self {
        self.limit = self.limit.min(limit);
        self
    }

    /// The shader for a number of bindings of nodes and of triangles.
    fn pipeline(&self, nodes: usize, blocks: usize) -> Result<wgpu::ComputePipeline, GpuError> {
        self.faults.scope(&self.device, || {
            let source = wgpu::ShaderSource::Wgsl(bindings::shader(nodes, blocks).into());
            let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("cast"), source });
            self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some("cast"),
                layout: None,
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        })
    }

    /// The device's name.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Casts all rays.
    pub(super) fn cast(&self, rays: &Rays) -> Result<Distances, GpuError> {
        let mut distances = Distances { outward: vec![f32::NAN; rays.len()], inward: vec![f32::NAN; rays.len()] };
        if rays.scan.triangle_count() == 0 || rays.len() == 0 {
            return Ok(distances);
        }
        let buffers = self.buffers(rays)?;
        for start in (0..rays.len()).step_by(buffers.capacity) {
            let end = rays.len().min(start + buffers.capacity);
            let upload: Vec<GpuRay> = (start..end).into_par_iter().map(|i| gpu_ray(rays, i)).collect();
            let pairs = self.dispatch(&buffers, &upload, rays)?;
            for (i, [outward, inward]) in (start..end).zip(pairs) {
                let distance = |d: f32| if d >= 0.0 { d } else { f32::NAN };
                (distances.outward[i], distances.inward[i]) = (distance(outward), distance(inward));
            }
        }
        Ok(distances)
    }

    fn buffers(&self, rays: &Rays) -> Result<Buffers, GpuError> {
        let (nodes, blocks) = rays.scan.parts();
        let limits = self.device.limits();
        let nodes_split = Split::new(nodes.len(), NODE, self.limit);
        let blocks_split = Split::new(blocks.len(), BLOCK, self.limit);
        let (nodes, blocks): (&[u8], &[u8]) = (bytemuck::cast_slice(nodes), bytemuck::cast_slice(blocks));
        // Two bindings are for the rays and their distances.
        let most = (limits.max_storage_buffers_per_shader_stage as usize)
            .min(limits.max_bindings_per_bind_group as usize - 1)
            .saturating_sub(2);
        if nodes_split.bindings + blocks_split.bindings > most {
            let (bytes, limit) = ((nodes.len() + blocks.len()) as u64, self.limit.saturating_mul(most as u64));
            return Err(GpuError::TooLarge { adapter: self.name.clone(), bytes, limit });
        }
        let pipeline = self.pipeline(nodes_split.bindings, blocks_split.bindings)?;
        let workgroups = limits.max_compute_workgroups_per_dimension as usize;
        let fitting = usize::try_from(self.limit).unwrap_or(usize::MAX) / size_of::<GpuRay>();
        let capacity = DISPATCH.min(fitting).min(workgroups * WORKGROUP).min(rays.len()).max(1);
        let buffer = |label, size: usize, usage| {
            let descriptor =
                wgpu::BufferDescriptor { label: Some(label), size: size as u64, usage, mapped_at_creation: false };
            self.device.create_buffer(&descriptor)
        };
        let filled = |label, contents| {
            let usage = wgpu::BufferUsages::STORAGE;
            self.device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
        };
        use wgpu::BufferUsages as Usage;
        self.faults.scope(&self.device, || {
            let setup = buffer("setup", size_of::<Setup>(), Usage::UNIFORM | Usage::COPY_DST);
            let nodes = nodes_split.pieces(nodes, NODE).map(|piece| filled("nodes", piece));
            let blocks = blocks_split.pieces(blocks, BLOCK).map(|piece| filled("blocks", piece));
            let scan: Vec<wgpu::Buffer> = nodes.chain(blocks).collect();
            let rays = buffer("rays", capacity * size_of::<GpuRay>(), Usage::STORAGE | Usage::COPY_DST);
            let size = capacity * size_of::<[f32; 2]>();
            let distances = buffer("distances", size, Usage::STORAGE | Usage::COPY_SRC);
            let download = buffer("download", size, Usage::MAP_READ | Usage::COPY_DST);
            let entries: Vec<_> = [&setup, &rays, &distances]
                .into_iter()
                .chain(&scan)
                .zip(0..)
                .map(|(buffer, binding)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            let bindings = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("cast"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            Buffers { setup, rays, distances, download, bindings, pipeline, nodes_split, blocks_split, capacity }
        })
    }

    /// Casts at most `buffers.capacity` rays and waits for their distances.
    fn dispatch(&self, buffers: &Buffers, upload: &[GpuRay], rays: &Rays) -> Result<Vec<[f32; 2]>, GpuError> {
        let setup = Setup {
            half_extent: rays.scan.half_extent().to_array(),
            max_distance: rays.max_distance,
            tolerance: rays.tolerance,
            count: upload.len() as u32,
            facing: rays.facing,
            cosine: rays.cosine,
            nodes_each: buffers.nodes_split.each as u32,
            blocks_each: buffers.blocks_split.each as u32,
            unused: [0; 2],
        };
        let bytes = std::mem::size_of_val(upload) as u64 / size_of::<GpuRay>() as u64 * size_of::<[f32; 2]>() as u64;
        self.faults.scope(&self.device, || {
            self.queue.write_buffer(&buffers.setup, 0, bytemuck::bytes_of(&setup));
            self.queue.write_buffer(&buffers.rays, 0, bytemuck::cast_slice(upload));
            let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
                pass.set_pipeline(&buffers.pipeline);
                pass.set_bind_group(0, &buffers.bindings, &[]);
                pass.dispatch_workgroups(upload.len().div_ceil(WORKGROUP) as u32, 1, 1);
            }
            encoder.copy_buffer_to_buffer(&buffers.distances, 0, &buffers.download, 0, Some(bytes));
            self.queue.submit([encoder.finish()]);
            let faults = self.faults.clone();
            buffers.download.map_async(wgpu::MapMode::Read, 0..bytes, move |mapped| {
                if let Err(error) = mapped {
                    faults.report(error.to_string());
                }
            });
            if let Err(error) = self.device.poll(wgpu::PollType::wait_indefinitely()) {
                self.faults.report(error.to_string());
            }
        })?;
        let mapped = buffers.download.get_mapped_range(0..bytes).map_err(|e| self.faults.failed(e.to_string()))?;
        let distances = bytemuck::pod_collect_to_vec(&mapped[..]);
        drop(mapped);
        buffers.download.unmap();
        Ok(distances)
    }
}

fn gpu_ray(rays: &Rays, i: usize) -> GpuRay {
    rays.get(i).map_or(GpuRay::zeroed(), |(origin, direction)| GpuRay {
        origin: origin.to_array(),
        present: 1.0,
        direction: direction.to_array(),
        unused: 0.0,
    })
}

impl Faults {
    /// Collects everything that no scope catches; otherwise wgpu would panic.
    fn listen(&self, device: &wgpu::Device) {
        let faults = self.clone();
        device.on_uncaptured_error(Arc::new(move |error| faults.report(error.to_string())));
        let faults = self.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping the device at the end is also reported.
            if reason != wgpu::DeviceLostReason::Destroyed {
                faults.report(format!("was lost: {message}"));
            }
        });
    }

    /// Runs `work` and returns its result, or the first error reported so far.
    fn scope<T>(&self, device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T, GpuError> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let [a, b, c] = [Validation, OutOfMemory, Internal].map(|filter| device.push_error_scope(filter));
        let result = work();
        // Scopes end in reverse order.
        for scope in [c, b, a] {
            if let Some(error) = block_on(scope.pop()) {
                self.report(error.to_string());
            }
        }
        match &*self.first.lock().unwrap_or_else(PoisonError::into_inner) {
            Some(message) => Err(self.failed(message.clone())),
            None => Ok(result),
        }
    }

    /// Keeps the first message.
    fn report(&self, message: String) {
        self.first.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
    }

    fn failed(&self, message: String) -> GpuError {
        GpuError::Failed { adapter: self.adapter.clone(), message }
    }
}
