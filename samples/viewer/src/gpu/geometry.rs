//! Meshes of a model on the GPU: vertices, indices, and a bottom-level structure for each mesh.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, Context,
    GeometryFlags, Holder, IndexFormat, Indices, Triangles, VertexFormat,
};
use lvk_gltf::{AlphaMode, Bounds, Material, Model, Pose, Primitive};

use super::deformation::{Deformation, MovedArrays, POSITION, RestArrays};
use super::emitters::{EmissiveMeshes, emission_color, emission_weight};
use super::instances::MeshKey;
use super::layout::{GpuAttributes, GpuGeometry, flag_if, geometry_flag};
use super::materials::{is_single_sided, is_thin, transmission};
use super::vertices::{PackedPositions, attributes};
use crate::model::{moved, movers};

/// Bytes of a position of four signed normalised numbers of 16 bits, and of an index.
const QUANTISED_POSITION: u64 = 8;
const INDEX: u64 = 4;

/// Most triangles of structures that are built at once, unless one has more. Software ray queries on a CPU build in host memory.
const MOST_BUILT: usize = 1 << 17;

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
    /// The box around it; `None` if its vertices move.
    pub(crate) bounds: Option<Bounds>,
    /// True if all surfaces are single-sided.
    pub(crate) is_single_sided: bool,
    pub(crate) blas: Holder<AccelStructHandle>,
}

/// Where the primitives of all meshes have their places in the arrays.
#[derive(Default)]
struct Arena {
    parts: Vec<Part>,
    float_count: usize,
    quantised_count: usize,
    vertex_count: usize,
    index_count: usize,
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
    is_single_sided: bool,
    /// True if the mesh has single- and double-sided primitives.
    has_mixed_sides: bool,
    /// Luminance of its light, if shadow rays look for it.
    emission_weight: f32,
}

impl Arena {
    /// Gives the primitives of a mesh that have triangles their places. Returns the number of them.
    fn add_mesh(&mut self, model: &Model, key: MeshKey) -> usize {
        let default = Material::default();
        let primitives = model.meshes.get(key.mesh).map_or(&[][..], |mesh| &mesh.primitives);
        let before = self.parts.len();
        for primitive in shown(primitives) {
            let number = primitive.material.unwrap_or(model.materials.len());
            let material = model.materials.get(number).unwrap_or(&default);
            let is_quantised =
                key.deformed_by.is_none() && PackedPositions::is_quantised(&primitive.positions);
            let is_still = key.deformed_by.is_none();
            let emission_weight = if is_still { emission_weight(material, model) } else { 0.0 };
            self.add(primitive, (number as u32, material), is_quantised, emission_weight);
        }
        let own = &mut self.parts[before..];
        // Rays cull all backs of an instance or none.
        let has_singles = own.iter().any(|part| part.is_single_sided);
        let has_mixed_sides = has_singles && own.iter().any(|part| !part.is_single_sided);
        own.iter_mut().for_each(|part| part.has_mixed_sides = has_mixed_sides);
        own.len()
    }

    fn add(
        &mut self,
        primitive: &Primitive,
        (number, material): (u32, &Material),
        is_quantised: bool,
        emission_weight: f32,
    ) {
        let vertex_count = primitive.vertex_count();
        let position_count = if is_quantised { &mut self.quantised_count } else { &mut self.float_count };
        self.parts.push(Part {
            first_before: None,
            emission_weight,
            is_quantised,
            first_position: *position_count,
            first_attributes: self.vertex_count,
            first_index: self.index_count,
            vertex_count: vertex_count as u32,
            triangle_count: primitive.triangle_count() as u32,
            material: number,
            is_opaque: is_opaque(material),
            is_single_sided: is_single_sided(material),
            has_mixed_sides: false,
        });
        *position_count += vertex_count;
        self.vertex_count += vertex_count;
        self.index_count += primitive.indices.len();
    }
}

impl Part {
    /// Bits of `Geometry.flags`.
    fn flags(&self) -> u32 {
        flag_if(self.is_quantised, geometry_flag::QUANTISED)
            | flag_if(self.is_single_sided, geometry_flag::SINGLE_SIDED)
            | flag_if(self.has_mixed_sides, geometry_flag::MIXED_SIDES)
    }
}

/// Primitives that have triangles.
fn shown(primitives: &[Primitive]) -> impl Iterator<Item = &Primitive> {
    primitives.iter().filter(|primitive| !primitive.indices.is_empty())
}

/// The buffers of an [`Arena`].
struct ArenaBuffers {
    floats: Holder<BufferHandle>,
    quantised: Holder<BufferHandle>,
    attributes: Holder<BufferHandle>,
    indices: Holder<BufferHandle>,
}

impl ArenaBuffers {
    /// Buffers without contents.
    fn new(ctx: &Context, arena: &Arena) -> lvk::Result<Self> {
        let read = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
        // A buffer has at least one element.
        let buffer = |debug_name, usage, count: usize, stride: u64| {
            let size_bytes = stride * count.max(1) as u64;
            ctx.create_buffer(&BufferDesc { usage, size_bytes, debug_name, ..BufferDesc::default() })
        };
        let attributes_bytes = size_of::<GpuAttributes>() as u64;
        Ok(Self {
            floats: buffer("positions", read, arena.float_count, POSITION)?,
            quantised: buffer("quantised positions", read, arena.quantised_count, QUANTISED_POSITION)?,
            attributes: buffer("attributes", BufferUsage::STORAGE, arena.vertex_count, attributes_bytes)?,
            indices: buffer("indices", read, arena.index_count, INDEX)?,
        })
    }

    /// Writes a primitive to its places.
    fn write(&self, ctx: &Context, part: &Part, primitive: &Primitive) -> lvk::Result<()> {
        let packed = PackedPositions::new(&primitive.positions);
        let (positions, stride) = self.positions(part);
        ctx.upload_buffer(**positions, stride * part.first_position as u64, packed.bytes())?;
        let offset = size_of::<GpuAttributes>() * part.first_attributes;
        let attributes = attributes(primitive);
        ctx.upload_buffer(*self.attributes, offset as u64, bytemuck::cast_slice(&attributes))?;
        let indices = bytemuck::cast_slice(&primitive.indices);
        ctx.upload_buffer(*self.indices, INDEX * part.first_index as u64, indices)
    }

    /// The buffer of a primitive's positions, and the bytes of each.
    fn positions(&self, part: &Part) -> (&Holder<BufferHandle>, u64) {
        if part.is_quantised { (&self.quantised, QUANTISED_POSITION) } else { (&self.floats, POSITION) }
    }

    /// `before`: address of the positions of the frame before.
    fn geometry(&self, part: &Part, before: u64) -> lvk::Result<GpuGeometry> {
        let (positions, stride) = self.positions(part);
        let positions = positions.address()? + stride * part.first_position as u64;
        Ok(GpuGeometry {
            positions,
            positions_before: part.first_before.map_or(positions, |first| before + POSITION * first as u64),
            attributes: self.attributes.address()?
                + (size_of::<GpuAttributes>() * part.first_attributes) as u64,
            indices: self.indices.address()? + INDEX * part.first_index as u64,
            material: part.material,
            flags: part.flags(),
            emission_weight: part.emission_weight,
            _padding: 0,
        })
    }

    fn moved(&self) -> lvk::Result<MovedArrays> {
        let place = |buffer: &Holder<BufferHandle>| Ok::<_, lvk::Error>((**buffer, buffer.address()?));
        Ok(MovedArrays { positions: place(&self.floats)?, attributes: place(&self.attributes)? })
    }

    fn triangles(&self, part: &Part) -> BlasGeometry {
        let (buffer, stride) = self.positions(part);
        let format = if part.is_quantised { VertexFormat::Snorm16x4 } else { VertexFormat::F32x3 };
        let (offset, flags) = (
            INDEX * part.first_index as u64,
            if part.is_opaque { GeometryFlags::OPAQUE } else { GeometryFlags::NO_DUPLICATE_ANY_HIT },
        );
        BlasGeometry::Triangles(Triangles {
            vertex_buffer: **buffer,
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

/// Writes the vertices of meshes, one mesh after the other.
struct MeshWriter<'a> {
    ctx: &'a Context,
    buffers: &'a ArenaBuffers,
    pose: &'a Pose,
    emissive: EmissiveMeshes,
    rest: RestArrays,
}

impl MeshWriter<'_> {
    /// Writes a mesh in a pose, whose first geometry has the number `first`; those that move in other poses also go to the vertices
    /// at rest. Returns the box around a mesh that does not deform.
    fn write(
        &mut self,
        model: &Model,
        (key, primitives): (MeshKey, &[Primitive]),
        (first, parts): (usize, &mut [Part]),
    ) -> lvk::Result<Option<Bounds>> {
        let mut bounds: Option<Bounds> = None;
        for (geometry, (primitive, part)) in (0..).zip(shown(primitives).zip(parts)) {
            let Some(node) = key.deformed_by else {
                self.buffers.write(self.ctx, part, primitive)?;
                if part.emission_weight > 0.0 {
                    let material = primitive.material.and_then(|number| model.materials.get(number));
                    let color = material.map_or(DVec3::ONE, emission_color);
                    let emission = (part.emission_weight, color);
                    self.emissive.add((first as u32, geometry), primitive, emission);
                }
                let around = Bounds::around(primitive.positions.iter().map(Vec3::from));
                bounds = bounds.into_iter().chain(around).reduce(Bounds::union);
                continue;
            };
            let (weights, joints) = movers(model, node, self.pose);
            self.buffers.write(self.ctx, part, &moved(primitive, weights, joints))?;
            if !model.animations.is_empty() {
                let places = [part.first_position, part.first_attributes];
                part.first_before = Some(self.rest.add((model, node), primitive, places));
            }
        }
        Ok(bounds)
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

    fn none() -> Self {
        Self {
            geometries: Vec::new(),
            triangle_counts: Vec::new(),
            emissive: EmissiveMeshes::default(),
            meshes: HashMap::new(),
            _buffers: Vec::new(),
        }
    }

    /// Uploads meshes in a pose and builds their structures. `keys` are in order. Primitives without triangles are left out. The
    /// default material has the number of the model's materials. The model loses each mesh once it is uploaded.
    pub(crate) fn upload(
        ctx: &Context,
        model: &mut Model,
        pose: &Pose,
        keys: &[MeshKey],
    ) -> lvk::Result<UploadedMeshes> {
        let mut arena = Arena::default();
        let mut runs: Vec<(MeshKey, usize)> =
            keys.iter().map(|key| (*key, arena.add_mesh(model, *key))).collect();
        runs.retain(|(_, count)| *count > 0);
        if arena.parts.is_empty() {
            return Ok(UploadedMeshes { meshes: Self::none(), deformation: None });
        }
        let buffers = ArenaBuffers::new(ctx, &arena)?;
        let mut parts = arena.parts;
        let (emissive, rest) = (EmissiveMeshes::default(), RestArrays::default());
        let mut writer = MeshWriter { ctx, buffers: &buffers, pose, emissive, rest };
        let bounds = write_meshes(&mut writer, model, &runs, &mut parts)?;
        let MeshWriter { emissive, rest, .. } = writer;
        let deformation = Deformation::new(ctx, rest, buffers.moved()?)?;
        let before = deformation.as_ref().map_or(Ok(0), Deformation::before_address)?;
        let geometries =
            parts.iter().map(|part| buffers.geometry(part, before)).collect::<lvk::Result<_>>()?;
        let triangle_counts = parts.iter().map(|part| part.triangle_count).collect();
        let meshes = build(ctx, model, (&runs, &bounds), &parts, &buffers)?;
        let ArenaBuffers { floats, quantised, attributes, indices } = buffers;
        let _buffers = vec![floats, quantised, attributes, indices];
        Ok(UploadedMeshes {
            meshes: Self { geometries, triangle_counts, emissive, meshes, _buffers },
            deformation,
        })
    }
}

/// Writes all meshes, each of so many geometries, and frees their vertices. Returns the boxes around them.
fn write_meshes(
    writer: &mut MeshWriter<'_>,
    model: &mut Model,
    runs: &[(MeshKey, usize)],
    parts: &mut [Part],
) -> lvk::Result<Vec<Option<Bounds>>> {
    let (mut bounds, mut first) = (Vec::new(), 0);
    for (place, (key, count)) in runs.iter().enumerate() {
        let primitives = std::mem::take(&mut model.meshes[key.mesh].primitives);
        let own = &mut parts[first..first + count];
        bounds.push(writer.write(model, (*key, &primitives), (first, own))?);
        // Other nodes may show the mesh with other vertices.
        if runs.get(place + 1).is_some_and(|(next, _)| next.mesh == key.mesh) {
            model.meshes[key.mesh].primitives = primitives;
        }
        first += count;
    }
    Ok(bounds)
}

/// Builds a structure for each mesh, of so many geometries.
fn build(
    ctx: &Context,
    model: &Model,
    (runs, bounds): (&[(MeshKey, usize)], &[Option<Bounds>]),
    parts: &[Part],
    buffers: &ArenaBuffers,
) -> lvk::Result<HashMap<MeshKey, GpuMesh>> {
    let all: Vec<BlasGeometry> = parts.iter().map(|part| buffers.triangles(part)).collect();
    let mut rest = all.as_slice();
    let (mut descs, mut sizes) = (Vec::new(), Vec::new());
    let mut next = 0;
    for (key, count) in runs {
        let (geometries, after) = rest.split_at(*count);
        rest = after;
        let own = &parts[next..next + count];
        sizes.push(own.iter().map(|part| part.triangle_count as usize).sum());
        next += count;
        let debug_name = model.meshes[key.mesh].name.as_deref().unwrap_or("mesh");
        let update = if key.deformed_by.is_some() { BuildFlags::ALLOW_UPDATE } else { BuildFlags::empty() };
        let flags = BuildFlags::default() | update;
        descs.push(BlasDesc { geometries, flags, debug_name, ..BlasDesc::default() });
    }
    let mut built = Vec::new();
    for batch in batches(&descs, &sizes) {
        built.extend(ctx.create_blas_batch(batch)?);
    }
    let mut next = 0;
    let pairs = runs.iter().zip(bounds).zip(built);
    Ok(pairs
        .map(|(((key, count), bounds), blas)| {
            let (first_geometry, geometry_count) = (next, *count as u32);
            next += geometry_count;
            let own = &parts[first_geometry as usize..next as usize];
            let is_single_sided = own.iter().all(|part| part.is_single_sided);
            (*key, GpuMesh { first_geometry, geometry_count, bounds: *bounds, is_single_sided, blas })
        })
        .collect())
}

/// Cuts a list into runs of elements whose sizes sum up to at most [`MOST_BUILT`], or of one element.
fn batches<'a, T>(mut list: &'a [T], mut sizes: &[usize]) -> Vec<&'a [T]> {
    let mut batches = Vec::new();
    while !list.is_empty() {
        let mut sum = 0;
        let fits = |size: &&usize| {
            sum += **size;
            sum <= MOST_BUILT
        };
        let count = sizes.iter().take_while(fits).count().clamp(1, list.len());
        let (batch, rest) = list.split_at(count);
        batches.push(batch);
        (list, sizes) = (rest, sizes.get(count..).unwrap_or_default());
    }
    batches
}

/// True if no ray goes on behind a surface of the material without a bend.
fn is_opaque(material: &Material) -> bool {
    let is_pane = is_thin(material) && transmission(material) > 0.0;
    material.alpha_mode == AlphaMode::Opaque && !is_pane
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_have_all_elements_in_order_and_no_more_triangles_than_they_may() {
        let sizes = [5, MOST_BUILT - 5, 1, 2 * MOST_BUILT, MOST_BUILT, 0, 7];
        let all: Vec<usize> = (0..sizes.len()).collect();
        assert_eq!(batches(&all, &sizes), [&all[..2], &all[2..3], &all[3..4], &all[4..6], &all[6..]]);
        assert!(batches::<usize>(&[], &[]).is_empty());
    }
}
