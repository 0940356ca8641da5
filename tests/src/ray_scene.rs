//! A scene for the GPU and for the reference.

use lvk::glam::{Affine3A, DAffine3, Quat, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, Context,
    GeometryFlags, GeometryTransform, Holder, IndexFormat, Indices, InstanceFlags, Result, TlasDesc,
    TlasInstance, Triangles, transform_rows,
};

use crate::meshes::Mesh;
use crate::reference::{self, Reference};

/// Flags of software builds: by the CPU and by the GPU, with all kinds of leaves.
pub const BUILD_FLAGS: [BuildFlags; 6] = [
    BuildFlags::FAST_TRACE,
    BuildFlags::FAST_BUILD,
    BuildFlags::LOW_MEMORY,
    BuildFlags::FAST_TRACE.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::ALLOW_UPDATE),
    BuildFlags::LOW_MEMORY.union(BuildFlags::FAST_BUILD).union(BuildFlags::ALLOW_UPDATE),
];

/// Memory layout of the vertices and indices of a geometry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Layout {
    /// Three packed vertices for each triangle, no indices.
    #[default]
    Unshared,
    /// Packed vertices with 16-bit indices.
    Indexed16,
    /// Packed vertices with 32-bit indices.
    Indexed32,
    /// 8 unused bytes before each vertex, 16-bit indices after 6 unused bytes.
    Interleaved,
}

/// One geometry of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Triangles of the geometry.
    pub mesh: Mesh,
    /// Memory layout of the triangles.
    pub layout: Layout,
    /// Transform of the vertices before the build.
    pub transform: Option<Affine3A>,
    /// True if the transform is read from a buffer, after another one.
    pub transform_in_buffer: bool,
    /// Flags.
    pub flags: GeometryFlags,
}

impl Part {
    /// Returns an opaque geometry without a transform.
    pub fn new(mesh: Mesh, layout: Layout) -> Self {
        let (transform_in_buffer, flags) = (false, GeometryFlags::OPAQUE);
        Self { mesh, layout, transform: None, transform_in_buffer, flags }
    }
}

/// One instance of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// Number of the model.
    pub model: usize,
    /// Transform from object space to world space.
    pub transform: Affine3A,
    /// Custom index that hits report.
    pub custom_index: u32,
    /// Mask: rays see the instance if their mask has one of its bits.
    pub mask: u8,
    /// Hit group offset.
    pub hit_group_offset: u32,
    /// Flags.
    pub flags: InstanceFlags,
}

impl Placed {
    /// Returns an instance of a model with default mask, flags and numbers.
    pub fn new(model: usize, transform: Affine3A) -> Self {
        Self {
            model,
            transform,
            custom_index: 0,
            mask: 0xff,
            hit_group_offset: 0,
            flags: InstanceFlags::empty(),
        }
    }
}

/// Offset of a transform in its buffer, in bytes.
pub const MATRIX_OFFSET: u64 = 48;

/// Models and their instances.
#[derive(Debug, Clone, PartialEq)]
pub struct RayScene {
    /// Geometries of each model.
    pub models: Vec<Vec<Part>>,
    /// The instances.
    pub placed: Vec<Placed>,
}

/// A scene on the GPU.
pub struct GpuScene {
    /// BLAS of each model.
    pub models: Vec<Holder<AccelStructHandle>>,
    /// TLAS of all instances.
    pub tlas: Holder<AccelStructHandle>,
    /// The buffers of every part: vertices, indices.
    pub buffers: Vec<PartBuffers>,
}

/// Buffers of a geometry.
pub struct PartBuffers {
    /// Holds the positions.
    pub vertices: Holder<BufferHandle>,
    /// Holds the indices, if there are any.
    pub indices: Option<Holder<BufferHandle>>,
    /// Holds the transform at [`MATRIX_OFFSET`], if it is in a buffer.
    pub matrix: Option<Holder<BufferHandle>>,
}

impl RayScene {
    /// Returns a scene of one geometry and one instance without a transform.
    pub fn single(mesh: Mesh, layout: Layout) -> Self {
        let placed = vec![Placed::new(0, Affine3A::IDENTITY)];
        Self { models: vec![vec![Part::new(mesh, layout)]], placed }
    }

    /// Returns overlapping instances, rotated, mirrored and of several masks. Each has eight geometries far apart
    /// from each other, so that re-braiding may open it.
    pub fn scattered(flags: GeometryFlags) -> Self {
        let meshes = [Mesh::sphere(6), Mesh::cube_grid(2)];
        let part = |mesh: &Mesh, corner: u32| {
            let at = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
            let transform = Some(Affine3A::from_translation(at * 5.0 - 2.5));
            Part { flags, transform, ..Part::new(mesh.clone(), Layout::Indexed16) }
        };
        let models = meshes.iter().map(|mesh| (0..8).map(|corner| part(mesh, corner)).collect()).collect();
        let place = |number: u32| {
            let turn = Quat::from_axis_angle(Vec3::new(1.0, 0.3, -0.5).normalize(), 0.6 * number as f32);
            let scale = Vec3::new(if number % 3 == 1 { -0.9 } else { 0.9 }, 1.0, 0.8);
            let to = Vec3::new(0.4 * number as f32, 0.0, 0.2);
            let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
            let (custom_index, mask) = (900 - number, 1 << (number % 3));
            Placed { custom_index, mask, ..Placed::new(number as usize % 2, transform) }
        };
        Self { models, placed: (0..10).map(place).collect() }
    }

    /// Returns the reference of the scene.
    pub fn reference(&self) -> Reference {
        let models: Vec<Vec<_>> =
            self.models.iter().map(|parts| parts.iter().map(reference_geometry).collect()).collect();
        let instance = |placed: &Placed| reference::Instance {
            geometries: &models[placed.model],
            transform: double(&placed.transform),
            custom_index: placed.custom_index,
            mask: placed.mask,
            flip_facing: placed.flags.contains(InstanceFlags::FLIP_FACING),
            no_cull: placed.flags.contains(InstanceFlags::NO_CULL),
            force_opaque: force_opaque(placed.flags),
        };
        Reference::new(&self.placed.iter().map(instance).collect::<Vec<_>>())
    }

    /// Uploads the scene: all BLASes in one batch, and a TLAS of all instances.
    pub fn upload(&self, ctx: &Context) -> Result<GpuScene> {
        self.upload_with(ctx, BuildFlags::default(), BuildFlags::default(), 0)
    }

    /// As [`upload`](Self::upload), with build flags of the BLASes and of the TLAS, and a capacity of additional
    /// instances.
    pub fn upload_with(
        &self,
        ctx: &Context,
        models: BuildFlags,
        top: BuildFlags,
        capacity: u32,
    ) -> Result<GpuScene> {
        let (models, buffers) = upload_models(ctx, &self.models, models)?;
        let instances = instances(&self.placed, &models);
        let desc = TlasDesc { instances: &instances, capacity, flags: top, ..Default::default() };
        Ok(GpuScene { tlas: ctx.create_tlas(&desc)?, models, buffers })
    }
}

/// Returns the instances for a TLAS.
pub fn instances(placed: &[Placed], models: &[Holder<AccelStructHandle>]) -> Vec<TlasInstance> {
    let instance = |placed: &Placed| TlasInstance {
        transform: transform_rows(&placed.transform),
        blas: *models[placed.model],
        custom_index: placed.custom_index,
        mask: placed.mask,
        hit_group_offset: placed.hit_group_offset,
        flags: placed.flags,
    };
    placed.iter().map(instance).collect()
}

/// Returns the bytes of the positions in a layout.
pub fn vertex_bytes(mesh: &Mesh, layout: Layout) -> Vec<u8> {
    let mesh = if layout == Layout::Unshared { mesh.unshared() } else { mesh.clone() };
    match layout {
        Layout::Interleaved => {
            let floats = mesh.positions.iter().flat_map(|[x, y, z]| [f32::NAN, 1e9, *x, *y, *z]);
            bytemuck::cast_slice(&floats.collect::<Vec<f32>>()).to_vec()
        }
        _ => bytemuck::cast_slice(&mesh.positions).to_vec(),
    }
}

/// Uploads the geometries of one model and returns their buffers.
pub fn upload_geometries(ctx: &Context, parts: &[Part]) -> Result<(Vec<PartBuffers>, Vec<BlasGeometry>)> {
    let mut buffers = Vec::with_capacity(parts.len());
    let mut geometries = Vec::with_capacity(parts.len());
    for part in parts {
        let (uploaded, geometry) = upload_part(ctx, part)?;
        buffers.push(uploaded);
        geometries.push(BlasGeometry::Triangles(geometry));
    }
    Ok((buffers, geometries))
}

fn upload_models(
    ctx: &Context,
    models: &[Vec<Part>],
    flags: BuildFlags,
) -> Result<(Vec<Holder<AccelStructHandle>>, Vec<PartBuffers>)> {
    let mut buffers = Vec::new();
    let mut geometries = Vec::new();
    for parts in models {
        let (uploaded, of_model) = upload_geometries(ctx, parts)?;
        buffers.extend(uploaded);
        geometries.push(of_model);
    }
    let desc = |geometries| BlasDesc { geometries, flags, debug_name: "model", ..Default::default() };
    let descs: Vec<_> = geometries.iter().map(|of_model| desc(&of_model[..])).collect();
    Ok((ctx.create_blas_batch(&descs)?, buffers))
}

fn upload_part(ctx: &Context, part: &Part) -> Result<(PartBuffers, Triangles)> {
    let input = |data: &[u8], debug_name| {
        let usage = BufferUsage::ACCEL_INPUT | BufferUsage::STORAGE;
        ctx.create_buffer(&BufferDesc { data: Some(data), usage, debug_name, ..Default::default() })
    };
    let mut vertices = vertex_bytes(&part.mesh, part.layout);
    vertices.resize(vertices.len().max(12), 0);
    let vertices = input(&vertices, "vertices")?;
    let triangle_count = part.mesh.triangles.len() as u32;
    let (indices, offset, format) = index_bytes(part);
    let indices = if indices.is_empty() { None } else { Some(input(&indices, "indices")?) };
    let (vertex_offset, vertex_stride) = if part.layout == Layout::Interleaved { (8, 20) } else { (0, 0) };
    let vertex_count = match part.layout {
        Layout::Unshared => triangle_count * 3,
        _ => part.mesh.positions.len() as u32,
    };
    let rows = part.transform.as_ref().map(transform_rows);
    let by_value = rows.map(GeometryTransform::Rows);
    let matrix = match rows.filter(|_| part.transform_in_buffer) {
        Some(rows) => Some(input(bytemuck::cast_slice(&[[f32::NAN; 12], rows]), "matrix")?),
        None => None,
    };
    let triangles = Triangles {
        vertex_offset,
        vertex_stride,
        indices: indices.as_ref().map(|buffer| Indices { buffer: **buffer, offset, format }),
        triangle_count,
        transform: matrix.as_ref().map_or(by_value, |buffer| {
            Some(GeometryTransform::Buffer { buffer: **buffer, offset: MATRIX_OFFSET })
        }),
        flags: part.flags,
        ..Triangles::packed(*vertices, vertex_count)
    };
    Ok((PartBuffers { vertices, indices, matrix }, triangles))
}

fn index_bytes(part: &Part) -> (Vec<u8>, u64, IndexFormat) {
    let indices = part.mesh.triangles.iter().flatten().copied();
    match part.layout {
        Layout::Unshared => (Vec::new(), 0, IndexFormat::U32),
        Layout::Indexed32 => {
            (bytemuck::cast_slice(&indices.collect::<Vec<u32>>()).to_vec(), 0, IndexFormat::U32)
        }
        Layout::Indexed16 | Layout::Interleaved => {
            let junk = if part.layout == Layout::Interleaved { 3 } else { 0 };
            let junk_indices = std::iter::repeat_n(u16::MAX, junk);
            let all: Vec<u16> = junk_indices.chain(indices.map(|index| index as u16)).collect();
            (bytemuck::cast_slice(&all).to_vec(), junk as u64 * 2, IndexFormat::U16)
        }
    }
}

fn reference_geometry(part: &Part) -> reference::Geometry {
    reference::Geometry {
        positions: part.mesh.positions.iter().map(|position| position.map(f64::from).into()).collect(),
        triangles: part.mesh.triangles.clone(),
        transform: part.transform.as_ref().map_or(DAffine3::IDENTITY, double),
        is_opaque: part.flags.contains(GeometryFlags::OPAQUE),
    }
}

fn force_opaque(flags: InstanceFlags) -> Option<bool> {
    let forced = flags.intersects(InstanceFlags::FORCE_OPAQUE | InstanceFlags::FORCE_NO_OPAQUE);
    forced.then(|| flags.contains(InstanceFlags::FORCE_OPAQUE))
}

fn double(transform: &Affine3A) -> DAffine3 {
    DAffine3::from_cols_array(&transform.to_cols_array().map(f64::from))
}
