//! Meshes of a model on the GPU: vertices, indices, and a bottom-level structure for each mesh.

use std::collections::HashMap;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildFlags, Context, GeometryFlags,
    Holder, IndexFormat, Indices, Triangles, VertexFormat,
};
use lvk_gltf::{AlphaMode, Material, Model, Pose, Primitive};
use lvk_samples::app::array_buffer::array;

use super::deformation::{Deformation, MovedArrays, POSITION, RestArrays};
use super::emitters::{EmissiveMeshes, emission_weight};
use super::instances::MeshKey;
use super::layout::{GpuAttributes, GpuGeometry, QUANTISED};
use super::vertices::{PackedPositions, attributes};
use crate::model::{moved, movers};

/// Meshes on the GPU.
pub(crate) struct GpuMeshes {
    /// The table of geometries.
    pub(crate) geometries: Vec<GpuGeometry>,
    /// Triangles of each geometry of the table.
    pub(crate) triangle_counts: Vec<u32>,
    /// Triangles that glow.
    pub(crate) emissive: EmissiveMeshes,
    /// The meshes that have triangles.
    meshes: HashMap<MeshKey, GpuMesh>,
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
    emissive: EmissiveMeshes,
}

/// A primitive in the arrays.
struct Part {
    /// The place of its positions among those of the frame before, if they move.
    first_before: Option<usize>,
    is_quantised: bool,
    first_position: usize,
    first_attributes: usize,
    first_index: usize,
    vertex_count: u32,
    triangle_count: u32,
    material: u32,
    is_opaque: bool,
    /// Luminance of its light, if shadow rays look for it.
    emission_weight: f32,
}

impl Arena {
    /// Adds the primitives of a mesh that have triangles, in a pose; those that move in other poses also go to `rest`.
    fn add_mesh(&mut self, model: &Model, pose: &Pose, key: MeshKey, rest: &mut RestArrays) {
        let (default, first) = (Material::default(), self.parts.len());
        let primitives = model.meshes.get(key.mesh).map_or(&[][..], |mesh| &mesh.primitives);
        for primitive in primitives.iter().filter(|primitive| !primitive.indices.is_empty()) {
            let number = primitive.material.unwrap_or(model.materials.len());
            let material = model.materials.get(number).unwrap_or(&default);
            let is_opaque = is_opaque(material);
            let Some(node) = key.deformed_by else {
                self.add(primitive, number as u32, is_opaque);
                self.add_emission(first, primitive, emission_weight(material, model));
                continue;
            };
            let (weights, joints) = movers(model, node, pose);
            self.add(&moved(primitive, weights, joints), number as u32, is_opaque);
            if let Some(part) = self.parts.last_mut().filter(|_| !model.animations.is_empty()) {
                let places = [part.first_position, part.first_attributes];
                part.first_before = Some(rest.add((model, node), primitive, places));
            }
        }
    }

    /// Shadow rays look for light of the last geometry, of a mesh whose first one has the place `first`.
    fn add_emission(&mut self, first: usize, primitive: &Primitive, weight: f32) {
        if let Some(part) = self.parts.last_mut().filter(|_| weight > 0.0) {
            part.emission_weight = weight;
            let geometry = self.parts.len() - 1 - first;
            self.emissive.add(first as u32, geometry as u32, primitive, weight);
        }
    }

    fn add(&mut self, primitive: &Primitive, material: u32, is_opaque: bool) {
        let packed = PackedPositions::new(&primitive.positions);
        let is_quantised = matches!(packed, PackedPositions::Quantised(_));
        self.parts.push(Part {
            first_before: None,
            emission_weight: 0.0,
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

    /// `before`: address of the positions of the frame before.
    fn geometry(&self, part: &Part, before: u64) -> lvk::Result<GpuGeometry> {
        let (positions, stride) =
            if part.is_quantised { (&self.quantised, 8) } else { (&self.floats, POSITION) };
        let positions = positions.address()? + stride * part.first_position as u64;
        Ok(GpuGeometry {
            positions,
            positions_before: part.first_before.map_or(positions, |first| before + POSITION * first as u64),
            attributes: self.attributes.address()?
                + (size_of::<GpuAttributes>() * part.first_attributes) as u64,
            indices: self.indices.address()? + 4 * part.first_index as u64,
            material: part.material,
            flags: if part.is_quantised { QUANTISED } else { 0 },
            emission_weight: part.emission_weight,
            _padding: 0,
        })
    }

    fn moved(&self) -> lvk::Result<MovedArrays> {
        let place = |buffer: &Holder<BufferHandle>| Ok::<_, lvk::Error>((**buffer, buffer.address()?));
        Ok(MovedArrays { positions: place(&self.floats)?, attributes: place(&self.attributes)? })
    }

    fn triangles(&self, part: &Part) -> BlasGeometry {
        let (buffer, stride, format) = match part.is_quantised {
            true => (*self.quantised, 8, VertexFormat::Snorm16x4),
            false => (*self.floats, POSITION, VertexFormat::F32x3),
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

/// Meshes and what moves their vertices.
pub(crate) struct UploadedMeshes {
    pub(crate) meshes: GpuMeshes,
    /// `None` if no vertex moves.
    pub(super) deformation: Option<Deformation>,
}

impl GpuMeshes {
    /// The mesh of a key, if it has triangles.
    pub(crate) fn get(&self, key: MeshKey) -> Option<&GpuMesh> {
        self.meshes.get(&key)
    }

    /// All structures.
    pub(crate) fn structures(&self) -> impl Iterator<Item = AccelStructHandle> {
        self.meshes.values().map(|mesh| *mesh.blas)
    }

    /// Structures of meshes whose vertices move.
    pub(crate) fn deformed(&self) -> Vec<AccelStructHandle> {
        let mut keys: Vec<_> = self.meshes.keys().filter(|key| key.deformed_by.is_some()).collect();
        keys.sort();
        keys.iter().map(|key| *self.meshes[key].blas).collect()
    }

    /// Uploads meshes in a pose and builds their structures. Primitives without triangles are left out. The default material has
    /// the number of the model's materials.
    pub(crate) fn upload(
        ctx: &Context,
        model: &Model,
        pose: &Pose,
        keys: &[MeshKey],
    ) -> lvk::Result<UploadedMeshes> {
        let (mut arena, mut rest) = (Arena::default(), RestArrays::default());
        let mut runs = Vec::new();
        for key in keys {
            let before = arena.parts.len();
            arena.add_mesh(model, pose, *key, &mut rest);
            runs.push((*key, arena.parts.len() - before));
        }
        runs.retain(|(_, count)| *count > 0);
        if arena.parts.is_empty() {
            let meshes = Self {
                geometries: Vec::new(),
                triangle_counts: Vec::new(),
                emissive: EmissiveMeshes::default(),
                meshes: HashMap::new(),
                _buffers: Vec::new(),
            };
            return Ok(UploadedMeshes { meshes, deformation: None });
        }
        let emissive = std::mem::take(&mut arena.emissive);
        let (buffers, parts) = ArenaBuffers::new(ctx, arena)?;
        let deformation = Deformation::new(ctx, rest, buffers.moved()?)?;
        let before = deformation.as_ref().map_or(Ok(0), Deformation::before_address)?;
        let geometries =
            parts.iter().map(|part| buffers.geometry(part, before)).collect::<lvk::Result<_>>()?;
        let triangle_counts = parts.iter().map(|part| part.triangle_count).collect();
        let meshes = build(ctx, model, &runs, &parts, &buffers)?;
        let ArenaBuffers { floats, quantised, attributes, indices } = buffers;
        let _buffers = vec![floats, quantised, attributes, indices];
        Ok(UploadedMeshes {
            meshes: Self { geometries, triangle_counts, emissive, meshes, _buffers },
            deformation,
        })
    }
}

/// Builds a structure for each mesh, of so many geometries.
fn build(
    ctx: &Context,
    model: &Model,
    runs: &[(MeshKey, usize)],
    parts: &[Part],
    buffers: &ArenaBuffers,
) -> lvk::Result<HashMap<MeshKey, GpuMesh>> {
    let all: Vec<BlasGeometry> = parts.iter().map(|part| buffers.triangles(part)).collect();
    let mut rest = all.as_slice();
    let mut descs = Vec::new();
    for (key, count) in runs {
        let (geometries, after) = rest.split_at(*count);
        rest = after;
        let debug_name = model.meshes[key.mesh].name.as_deref().unwrap_or("mesh");
        let update = if key.deformed_by.is_some() { BuildFlags::ALLOW_UPDATE } else { BuildFlags::empty() };
        let flags = BuildFlags::default() | update;
        descs.push(BlasDesc { geometries, flags, debug_name, ..BlasDesc::default() });
    }
    let built = ctx.create_blas_batch(&descs)?;
    let mut next = 0;
    let pairs = runs.iter().zip(built);
    Ok(pairs
        .map(|((key, count), blas)| {
            let (first_geometry, geometry_count) = (next, *count as u32);
            next += geometry_count;
            (*key, GpuMesh { first_geometry, geometry_count, blas })
        })
        .collect())
}

/// True if no ray goes on behind a surface of the material without a bend.
fn is_opaque(material: &Material) -> bool {
    let is_thin = material.volume.as_ref().is_none_or(|volume| volume.thickness <= 0.0);
    let is_pane =
        is_thin && material.transmission.as_ref().is_some_and(|transmission| transmission.factor > 0.0);
    material.alpha_mode == AlphaMode::Opaque && !is_pane
}
