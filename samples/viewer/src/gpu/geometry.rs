//! Meshes of a model on the GPU: vertices, indices, and a bottom-level structure for each mesh.

use std::collections::HashSet;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, Context, GeometryFlags, Holder,
    IndexFormat, Indices, Triangles, VertexFormat,
};
use lvk_gltf::{AlphaMode, Material, Model, Placement, Primitive};
use lvk_samples::app::array_buffer::array;

use super::layout::{GpuAttributes, GpuGeometry, QUANTISED};
use super::vertices::{PackedPositions, attributes};

/// Meshes on the GPU.
pub(crate) struct GpuMeshes {
    /// The table of geometries.
    pub(crate) geometries: Vec<GpuGeometry>,
    /// For each mesh the place of its first geometry, and its structure; `None` for a mesh without triangles.
    pub(crate) meshes: Vec<Option<GpuMesh>>,
    /// Triangles of each geometry of the table.
    pub(crate) triangle_counts: Vec<u32>,
    _buffers: Vec<Holder<BufferHandle>>,
}

/// A mesh on the GPU.
pub(crate) struct GpuMesh {
    pub(crate) first_geometry: u32,
    pub(crate) geometry_count: u32,
    pub(crate) blas: Holder<AccelStructHandle>,
}

/// Arrays while they are collected.
#[derive(Default)]
struct Arena {
    floats: Vec<[f32; 3]>,
    quantised: Vec<[i16; 4]>,
    attributes: Vec<GpuAttributes>,
    indices: Vec<u32>,
    parts: Vec<Part>,
}

/// A primitive in the arrays.
struct Part {
    is_quantised: bool,
    first_position: usize,
    first_attributes: usize,
    first_index: usize,
    vertex_count: u32,
    triangle_count: u32,
    material: u32,
    is_opaque: bool,
}

impl Arena {
    fn add(&mut self, primitive: &Primitive, material: u32, is_opaque: bool) {
        let packed = PackedPositions::new(&primitive.positions);
        let is_quantised = matches!(packed, PackedPositions::Quantised(_));
        self.parts.push(Part {
            is_quantised,
            first_position: if is_quantised { self.quantised.len() } else { self.floats.len() },
            first_attributes: self.attributes.len(),
            first_index: self.indices.len(),
            vertex_count: primitive.vertex_count() as u32,
            triangle_count: primitive.triangle_count() as u32,
            material,
            is_opaque,
        });
        match packed {
            PackedPositions::Floats(all) => self.floats.extend_from_slice(&all),
            PackedPositions::Quantised(all) => self.quantised.extend_from_slice(all),
        }
        self.attributes.extend(attributes(primitive));
        self.indices.extend_from_slice(&primitive.indices);
    }
}

/// The buffers of an [`Arena`].
struct ArenaBuffers {
    floats: Holder<BufferHandle>,
    quantised: Holder<BufferHandle>,
    attributes: Holder<BufferHandle>,
    indices: Holder<BufferHandle>,
}

impl ArenaBuffers {
    fn new(ctx: &Context, mut arena: Arena) -> lvk::Result<(Self, Vec<Part>)> {
        // A buffer has at least one element.
        arena.floats.push([0.0; 3]);
        arena.quantised.push([0; 4]);
        let read = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
        let buffers = Self {
            floats: array(ctx, "positions", read, &arena.floats)?,
            quantised: array(ctx, "quantised positions", read, &arena.quantised)?,
            attributes: array(ctx, "attributes", BufferUsage::STORAGE, &arena.attributes)?,
            indices: array(ctx, "indices", read, &arena.indices)?,
        };
        Ok((buffers, arena.parts))
    }

    fn geometry(&self, part: &Part) -> lvk::Result<GpuGeometry> {
        let (positions, stride) = if part.is_quantised { (&self.quantised, 8) } else { (&self.floats, 12) };
        Ok(GpuGeometry {
            positions: positions.address()? + stride * part.first_position as u64,
            attributes: self.attributes.address()?
                + (size_of::<GpuAttributes>() * part.first_attributes) as u64,
            indices: self.indices.address()? + 4 * part.first_index as u64,
            material: part.material,
            flags: if part.is_quantised { QUANTISED } else { 0 },
        })
    }

    fn triangles(&self, part: &Part) -> BlasGeometry {
        let (buffer, stride, format) = match part.is_quantised {
            true => (*self.quantised, 8, VertexFormat::Snorm16x4),
            false => (*self.floats, 12, VertexFormat::F32x3),
        };
        let (offset, flags) = (
            4 * part.first_index as u64,
            if part.is_opaque { GeometryFlags::OPAQUE } else { GeometryFlags::NO_DUPLICATE_ANY_HIT },
        );
        BlasGeometry::Triangles(Triangles {
            vertex_buffer: buffer,
            vertex_offset: stride * part.first_position as u64,
            vertex_stride: stride,
            vertex_format: format,
            vertex_count: part.vertex_count,
            indices: Some(Indices { buffer: *self.indices, offset, format: IndexFormat::U32 }),
            triangle_count: part.triangle_count,
            transform: None,
            flags,
        })
    }
}

impl GpuMeshes {
    /// Uploads the meshes that are placed and builds their structures. Primitives without triangles are left out. The default
    /// material has the number of the model's materials.
    pub(crate) fn new(ctx: &Context, model: &Model, placements: &[Placement]) -> lvk::Result<Self> {
        let mut arena = Arena::default();
        let mut counts = Vec::new();
        let default = Material::default();
        let placed: HashSet<usize> = placements.iter().map(|placement| placement.mesh).collect();
        for (place, mesh) in model.meshes.iter().enumerate() {
            let before = arena.parts.len();
            let is_shown = |primitive: &&Primitive| placed.contains(&place) && !primitive.indices.is_empty();
            for primitive in mesh.primitives.iter().filter(is_shown) {
                let number = primitive.material.unwrap_or(model.materials.len());
                let is_opaque = is_opaque(model.materials.get(number).unwrap_or(&default));
                arena.add(primitive, number as u32, is_opaque);
            }
            counts.push(arena.parts.len() - before);
        }
        if arena.parts.is_empty() {
            let meshes = counts.iter().map(|_| None).collect();
            return Ok(Self {
                geometries: Vec::new(),
                meshes,
                triangle_counts: Vec::new(),
                _buffers: Vec::new(),
            });
        }
        let (buffers, parts) = ArenaBuffers::new(ctx, arena)?;
        let geometries = parts.iter().map(|part| buffers.geometry(part)).collect::<lvk::Result<_>>()?;
        let triangle_counts = parts.iter().map(|part| part.triangle_count).collect();
        let meshes = build(ctx, model, &counts, &parts, &buffers)?;
        let ArenaBuffers { floats, quantised, attributes, indices } = buffers;
        let _buffers = vec![floats, quantised, attributes, indices];
        Ok(Self { geometries, meshes, triangle_counts, _buffers })
    }
}

/// Builds a structure for each mesh that has geometries.
fn build(
    ctx: &Context,
    model: &Model,
    counts: &[usize],
    parts: &[Part],
    buffers: &ArenaBuffers,
) -> lvk::Result<Vec<Option<GpuMesh>>> {
    let all: Vec<BlasGeometry> = parts.iter().map(|part| buffers.triangles(part)).collect();
    let mut rest = all.as_slice();
    let mut descs = Vec::new();
    for (mesh, count) in model.meshes.iter().zip(counts) {
        let (geometries, after) = rest.split_at(*count);
        rest = after;
        if !geometries.is_empty() {
            let debug_name = mesh.name.as_deref().unwrap_or("mesh");
            descs.push(BlasDesc { geometries, debug_name, ..BlasDesc::default() });
        }
    }
    let mut built = ctx.create_blas_batch(&descs)?.into_iter();
    let mut next = 0;
    let mesh = |count: &usize| {
        let (first_geometry, geometry_count) = (next, *count as u32);
        next += geometry_count;
        let blas = if *count == 0 { None } else { built.next() };
        blas.map(|blas| GpuMesh { first_geometry, geometry_count, blas })
    };
    Ok(counts.iter().map(mesh).collect())
}

/// True if no ray goes on behind a surface of the material without a bend.
fn is_opaque(material: &Material) -> bool {
    let is_thin = material.volume.as_ref().is_none_or(|volume| volume.thickness <= 0.0);
    let is_pane =
        is_thin && material.transmission.as_ref().is_some_and(|transmission| transmission.factor > 0.0);
    material.alpha_mode == AlphaMode::Opaque && !is_pane
}
