//! Test hooks for builds on the GPU: the raw memory of acceleration structures.

#![allow(missing_docs, reason = "only tests see it")]

use std::sync::Arc;

pub use super::cluster_model::SortedPrimitives;
pub use super::collapse_model::{BelowNode, Bvh2Child, Bvh2Reference, Bvh8Child, Bvh8Reference, any_tree};
pub use super::cpu_builds::{CpuBuild, ObvhsBuild, build_by_obvhs, build_on_threads};
pub use super::gpu_build_check::{CheckBounds, EMPTY, StructureFacts, check_structure};
pub use super::wide_tree::{CHILDREN, WideChild, WideLink, WideTree};
use crate::accel::geometry::BlasGeometry;
use crate::context::Context;
use crate::context::holder::Holder;
use crate::error::Result;
use crate::handle::BufferHandle;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage};
use crate::software_ray_query::gpu_build::geometry::gpu_geometries;
use crate::software_ray_query::gpu_build::layout::{BlasShape, BlobOffsets, BuildSource, GpuBuildPlan};
use crate::software_ray_query::gpu_build::refit_layout::{GpuRefitPlan, NodeFormat};
use crate::software_ray_query::layout::{LeafKind, MAX_BVH8_DEPTH};
use crate::software_ray_query::record::gpu_build::{GpuBuild, GpuRefit};

const ALIGNMENT: u64 = 256;

/// Content of the leaves of triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeafEncoding {
    /// Vertex positions.
    Corners,
    /// Vertex indices, a word each.
    Indexed,
    /// Vertex indices, 21 bits each.
    Packed,
}

/// A BLAS to build.
pub struct GpuBlasDesc<'a> {
    pub geometries: &'a [BlasGeometry],
    pub leaves: LeafEncoding,
}

/// An acceleration structure and its buffer.
pub struct GpuStructure {
    pub buffer: Holder<BufferHandle>,
    pub address: u64,
    pub most_height: u32,
    pub bytes: u64,
    plan: GpuRefitPlan,
}

/// Builds BLASes side by side.
pub fn build_blas(ctx: &Context, descs: &[GpuBlasDesc<'_>]) -> Result<Vec<GpuStructure>> {
    let (mut builds, mut built) = (Vec::new(), Vec::new());
    for desc in descs {
        let geometries = read_geometries(ctx, desc.geometries)?;
        let boxes = desc.geometries.iter().any(BlasGeometry::is_aabbs);
        let shape = BlasShape {
            leaf_kind: match desc.leaves {
                _ if boxes => LeafKind::Boxes,
                LeafEncoding::Corners => LeafKind::Triangles,
                LeafEncoding::Indexed => LeafKind::IndexedTriangles,
                LeafEncoding::Packed => LeafKind::PackedTriangles,
            },
            primitive_count: desc.geometries.iter().map(BlasGeometry::primitive_count).sum(),
            vertex_count: geometries.iter().map(|geometry| geometry.vertex_count).sum(),
            geometry_count: geometries.len() as u32,
        };
        let plan = GpuBuildPlan::blas("test", &shape)?;
        let (structure, target) = allocate_structure(ctx, &plan)?;
        let blob = structure.address;
        let reads = read_buffers(ctx, desc.geometries)?;
        builds.push(GpuBuild {
            plan,
            source: BuildSource::Geometries(geometries),
            blob,
            target,
            read_buffers: reads,
        });
        built.push(structure);
    }
    record(ctx, |cmd| cmd.record_gpu_builds(&builds))?;
    Ok(built)
}

/// Refits BLASes side by side.
pub fn refit(ctx: &Context, structures: &[(&GpuStructure, &[BlasGeometry])]) -> Result<()> {
    let mut refits = Vec::new();
    for (structure, geometries) in structures {
        refits.push(GpuRefit {
            plan: structure.plan,
            geometries: read_geometries(ctx, geometries)?,
            blob: structure.address,
            target: ctx.device_state().store.buffers.get(*structure.buffer)?,
            read_buffers: read_buffers(ctx, geometries)?,
        });
    }
    record(ctx, |cmd| cmd.record_gpu_refits(&refits))
}

/// Builds a TLAS from instance records in a buffer; `table` contains addresses of BLASes.
pub fn build_tlas(
    ctx: &Context,
    records: BufferHandle,
    count: u32,
    capacity: u32,
    table: Option<(BufferHandle, u32)>,
) -> Result<GpuStructure> {
    let plan = GpuBuildPlan::tlas("test", capacity)?;
    let (structure, target) = allocate_structure(ctx, &plan)?;
    let find = |handle| ctx.device_state().store.buffers.get(handle);
    let records = find(records)?;
    let mut reads = vec![Arc::clone(&records)];
    let mut addresses = None;
    if let Some((table, entries)) = table {
        let table = find(table)?;
        addresses = Some((table.address, entries));
        reads.push(table);
    }
    let source = BuildSource::Instances { records: records.address, count, table: addresses };
    let build = GpuBuild { plan, source, blob: structure.address, target, read_buffers: reads };
    record(ctx, |cmd| cmd.record_gpu_builds(&[build]))?;
    Ok(structure)
}

/// Returns the words of an acceleration structure.
pub fn read(ctx: &Context, structure: &GpuStructure) -> Result<Vec<u32>> {
    let mut words = vec![0_u32; (structure.bytes / 4) as usize];
    let offset = structure.address - ctx.buffer_address(*structure.buffer)?;
    ctx.download_buffer(*structure.buffer, offset, bytemuck::cast_slice_mut(&mut words))?;
    Ok(words)
}

/// Uploads an acceleration structure that was built elsewhere. Its header defines its format.
pub fn place(ctx: &Context, words: &[u32]) -> Result<GpuStructure> {
    let bytes = words.len() as u64 * 4;
    let (buffer, address) = memory(ctx, bytes)?;
    ctx.upload_buffer(*buffer, address - ctx.buffer_address(*buffer)?, bytemuck::cast_slice(words))?;
    let plan = GpuRefitPlan {
        format: if words[0] == 0 { NodeFormat::Wide } else { NodeFormat::Binary },
        leaf_kind: match words[1] {
            0 => LeafKind::Triangles,
            1 => LeafKind::IndexedTriangles,
            4 => LeafKind::PackedTriangles,
            _ => LeafKind::Boxes,
        },
        offsets: BlobOffsets {
            nodes: words[4],
            primitives: words[5],
            vertices: words[6],
            geometries: words[7],
        },
        node_count: words[8],
        primitive_count: words[3],
    };
    Ok(GpuStructure { buffer, address, most_height: u32::MAX, bytes, plan })
}

/// Sorts keys with the kernels of large builds. Returns the sorted keys, each with its index in `keys`.
///
/// Keys have 32 bits, and `low_bits` more in a second, lower word.
pub fn sort(ctx: &Context, keys: &[u64], low_bits: u32) -> Result<Vec<(u64, u32)>> {
    let sorter = super::sort_kernels::Sorter::new(keys, low_bits);
    let words = run_on(ctx, &sorter.words(), |cmd, target, address| sorter.record(cmd, target, address))?;
    Ok(sorter.sorted(&words))
}

/// Builds the binary tree of at least two sorted primitives with the kernel, whose codes must have
/// [`code_bits`] bits. Returns the tree, the root first, and the decision about each node.
pub fn cluster(ctx: &Context, primitives: &SortedPrimitives) -> Result<(Bvh2Reference, Vec<u32>)> {
    let run = super::cluster_kernels::ClusterRun::new(primitives)?;
    let words = run_on(ctx, &run.words(), |cmd, target, address| run.record(cmd, target, address))?;
    Ok(run.built(&words))
}

/// Returns the bits of codes in a build of `count` primitives.
pub fn code_bits(count: usize) -> Result<u32> {
    super::cluster_kernels::code_bits(count)
}

/// Collapses a binary tree of more than three primitives with the kernels.
///
/// Returns the wide tree, or `None` if it did not fit, and the capacity in nodes.
pub fn collapse(ctx: &Context, tree: &Bvh2Reference) -> Result<(Option<Bvh8Reference>, usize)> {
    let collapser = super::collapse_kernels::Collapser::new(tree)?;
    let words =
        run_on(ctx, &collapser.words(), |cmd, target, address| collapser.record(cmd, target, address))?;
    Ok((collapser.collapsed(&words), collapser.buffer_bytes()))
}

fn record(ctx: &Context, record: impl FnOnce(&mut crate::CommandBuffer) -> Result<()>) -> Result<()> {
    let mut cmd = ctx.acquire_command_buffer()?;
    record(&mut cmd)?;
    ctx.submit(cmd)?;
    Ok(())
}

/// Uploads words to a buffer, executes commands on them, and returns the words after that.
fn run_on(
    ctx: &Context,
    words: &[u32],
    commands: impl FnOnce(&mut crate::CommandBuffer, &Arc<Buffer>, u64) -> Result<()>,
) -> Result<Vec<u32>> {
    let (buffer, address) = memory(ctx, size_of_val(words) as u64)?;
    let offset = address - ctx.buffer_address(*buffer)?;
    ctx.upload_buffer(*buffer, offset, bytemuck::cast_slice(words))?;
    let target = ctx.device_state().store.buffers.get(*buffer)?;
    record(ctx, |cmd| commands(cmd, &target, address))?;
    let mut after = vec![0_u32; words.len()];
    ctx.download_buffer(*buffer, offset, bytemuck::cast_slice_mut(&mut after))?;
    Ok(after)
}

fn memory(ctx: &Context, bytes: u64) -> Result<(Holder<BufferHandle>, u64)> {
    let desc = BufferDesc {
        size_bytes: bytes + ALIGNMENT,
        usage: BufferUsage::STORAGE,
        debug_name: "structure",
        ..Default::default()
    };
    let buffer = ctx.create_buffer(&desc)?;
    let address = ctx.buffer_address(*buffer)?.next_multiple_of(ALIGNMENT);
    Ok((buffer, address))
}

fn allocate_structure(ctx: &Context, plan: &GpuBuildPlan) -> Result<(GpuStructure, Arc<Buffer>)> {
    let (buffer, address) = memory(ctx, plan.blob_bytes)?;
    let target = ctx.device_state().store.buffers.get(*buffer)?;
    let most_height = match plan.leaf_kind {
        LeafKind::Instances => plan.max_height(),
        _ => MAX_BVH8_DEPTH as u32,
    };
    let refit = GpuRefitPlan::from_build(plan);
    Ok((GpuStructure { buffer, address, most_height, bytes: plan.blob_bytes, plan: refit }, target))
}

fn read_geometries(
    ctx: &Context,
    geometries: &[BlasGeometry],
) -> Result<Vec<crate::software_ray_query::gpu_build::geometry::GpuGeometry>> {
    gpu_geometries("test", geometries, &|handle| ctx.device_state().store.buffers.get(handle), None)
}

fn read_buffers(ctx: &Context, geometries: &[BlasGeometry]) -> Result<Vec<Arc<Buffer>>> {
    let handles = geometries.iter().flat_map(BlasGeometry::buffers);
    handles.map(|handle| ctx.device_state().store.buffers.get(handle)).collect()
}
