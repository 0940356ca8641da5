//! A scene on the GPU: arrays, textures, sky and acceleration structures.

use std::ops::Range;
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use lvk::{
    AccelStructHandle, AddressMode, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, Context,
    GeometryFlags, Holder, IndexFormat, Indices, SamplerDesc, SamplerHandle, TextureHandle, TlasDesc,
    TlasInstance, Triangles, VertexFormat,
};

use super::HybridError;
use super::frame::SceneAddresses;
use super::scene_check::check;
use super::texture_density::lod_constant;
use crate::app::array_buffer::array;
use crate::app::scene_textures;
use crate::scene::{Material, Scene};

/// Mask bit of instances that stop light (`kMaskOpaque` in `shaders/hybrid/hit.glsl`).
const MASK_OPAQUE: u8 = 1;
/// Mask bit of instances that light passes through.
const MASK_REFRACTIVE: u8 = 2;
/// Texels on an edge of the sky's cube map.
const SKY_SIZE: u32 = 512;
/// `kNoTexture` in `shaders/common/scene_buffers.glsl`.
const NO_TEXTURE: u32 = u32::MAX;

/// A scene on the GPU.
pub(crate) struct GpuScene {
    pub(crate) triangle_count: u32,
    pub(crate) sky: Holder<TextureHandle>,
    pub(crate) surface_sampler: Holder<SamplerHandle>,
    pub(crate) sky_sampler: Holder<SamplerHandle>,
    pub(crate) tlas: Holder<AccelStructHandle>,
    /// Milliseconds that building the bottom-level structures took, submission and wait included.
    pub(crate) blas_build_ms: f64,
    /// Parts that the library made of the bottom-level structures, where they are too large for the device.
    pub(crate) blas_part_count: u32,
    arrays: Arrays,
    _textures: Vec<Holder<TextureHandle>>,
    blas: Vec<Holder<AccelStructHandle>>,
}

/// Places of hit groups in the pipelines that trace the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct HitGroups {
    /// Of opaque triangles.
    pub(crate) opaque: u32,
    /// Of those that light passes through.
    pub(crate) refractive: u32,
}

/// What the shaders reach by address; some of it is only held for them.
struct Arrays {
    positions: Holder<BufferHandle>,
    triangles: Holder<BufferHandle>,
    _held: [Holder<BufferHandle>; 4],
    addresses: SceneAddresses,
}

/// `Material` in `shaders/common/scene_buffers.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct GpuMaterial {
    albedo: [f32; 3],
    albedo_texture: u32,
    specular: [f32; 3],
    shininess: f32,
    emission: [f32; 3],
    reflectivity: f32,
    tint: [f32; 3],
    transmission: f32,
    ior: f32,
}

/// `TriangleInfo` in `shaders/common/scene_buffers.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TriangleInfo {
    material: u32,
    lod_constant: f32,
}

impl GpuScene {
    /// Uploads `scene` and builds its acceleration structures.
    pub(crate) fn new(ctx: &Context, scene: &Scene, hit_groups: HitGroups) -> Result<Self, HybridError> {
        check(scene)?;
        let textures: Vec<_> = scene
            .textures
            .iter()
            .map(|texture| scene_textures::picture(ctx, texture))
            .collect::<Result<_, _>>()?;
        let arrays = Arrays::new(ctx, scene, &textures)?;
        ctx.wait_idle()?;
        let start = Instant::now();
        let (blas, instances) = build_blas(ctx, scene, hit_groups, [*arrays.positions, *arrays.triangles])?;
        ctx.wait_idle()?;
        let blas_build_ms = start.elapsed().as_secs_f64() * 1e3;
        let mut blas_part_count = 0;
        for blas in &blas {
            blas_part_count += ctx.accel_struct_info(**blas)?.parts;
        }
        let debug_name = "scene tlas";
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, debug_name, ..TlasDesc::default() })?;
        Ok(Self {
            triangle_count: scene.triangles.len() as u32,
            sky: scene_textures::sky(ctx, &scene.sky, SKY_SIZE)?,
            surface_sampler: sampler(ctx, "surface sampler", AddressMode::Repeat)?,
            sky_sampler: sampler(ctx, "sky sampler", AddressMode::ClampToEdge)?,
            tlas,
            blas_build_ms,
            blas_part_count,
            arrays,
            _textures: textures,
            blas,
        })
    }

    /// Where the shaders find the arrays.
    pub(crate) fn addresses(&self) -> SceneAddresses {
        self.arrays.addresses
    }

    /// Vertex indices, three per triangle.
    pub(crate) fn triangles(&self) -> BufferHandle {
        self.arrays.triangles.handle()
    }

    /// How many bottom-level structures there are: one for opaque and one for refractive triangles.
    pub(crate) fn blas_count(&self) -> usize {
        self.blas.len()
    }
}

impl Arrays {
    fn new(ctx: &Context, scene: &Scene, textures: &[Holder<TextureHandle>]) -> lvk::Result<Self> {
        let infos: Vec<_> = (0..scene.triangles.len()).map(|i| triangle_info(scene, i)).collect();
        let materials: Vec<_> = scene.materials.iter().map(|m| gpu_material(m, textures)).collect();

        let read = BufferUsage::STORAGE;
        let input = read | BufferUsage::ACCEL_INPUT;
        let positions = array(ctx, "scene positions", input, &scene.positions)?;
        let normals = array(ctx, "scene normals", read, &scene.normals)?;
        let texcoords = array(ctx, "scene texture coordinates", read, &scene.texcoords)?;
        let triangles = array(ctx, "scene triangles", input | BufferUsage::INDEX, &scene.triangles)?;
        let triangle_infos = array(ctx, "scene triangle infos", read, &infos)?;
        let materials = array(ctx, "scene materials", read, &materials)?;
        let addresses = SceneAddresses {
            positions: ctx.buffer_address(*positions)?,
            normals: ctx.buffer_address(*normals)?,
            texcoords: ctx.buffer_address(*texcoords)?,
            triangles: ctx.buffer_address(*triangles)?,
            triangle_infos: ctx.buffer_address(*triangle_infos)?,
            materials: ctx.buffer_address(*materials)?,
        };
        Ok(Self { positions, triangles, _held: [normals, texcoords, triangle_infos, materials], addresses })
    }
}

fn triangle_info(scene: &Scene, triangle: usize) -> TriangleInfo {
    let material = scene.triangle_materials[triangle];
    let corner = scene.triangles[triangle].map(|vertex| vertex as usize);
    let texture = scene.materials[material as usize].albedo_texture;
    let size = texture.map_or([1, 1], |i| {
        let texture = &scene.textures[i as usize];
        [texture.width, texture.height]
    });
    let lod_constant =
        lod_constant(corner.map(|v| scene.positions[v]), corner.map(|v| scene.texcoords[v]), size);
    TriangleInfo { material, lod_constant }
}

fn gpu_material(material: &Material, textures: &[Holder<TextureHandle>]) -> GpuMaterial {
    GpuMaterial {
        albedo: material.albedo,
        albedo_texture: material.albedo_texture.map_or(NO_TEXTURE, |i| textures[i as usize].index()),
        specular: material.specular,
        shininess: material.shininess,
        emission: material.emission,
        reflectivity: material.reflectivity,
        tint: material.tint,
        transmission: material.transmission,
        ior: material.ior,
    }
}

fn sampler(ctx: &Context, debug_name: &str, address: AddressMode) -> lvk::Result<Holder<SamplerHandle>> {
    ctx.create_sampler(&SamplerDesc { address: [address; 3], debug_name, ..SamplerDesc::default() })
}

/// One structure for the opaque and one for the refractive triangles, whichever there are, and their instances.
fn build_blas(
    ctx: &Context,
    scene: &Scene,
    hit_groups: HitGroups,
    [positions, triangles]: [BufferHandle; 2],
) -> lvk::Result<(Vec<Holder<AccelStructHandle>>, Vec<TlasInstance>)> {
    let total = scene.triangles.len() as u32;
    let opaque = scene.opaque_triangle_count.min(total);
    let groups = [
        Group { name: "opaque blas", range: 0..opaque, mask: MASK_OPAQUE, hit_group: hit_groups.opaque },
        Group {
            name: "refractive blas",
            range: opaque..total,
            mask: MASK_REFRACTIVE,
            hit_group: hit_groups.refractive,
        },
    ];
    let groups: Vec<_> = groups.into_iter().filter(|group| !group.range.is_empty()).collect();
    let vertex_count = scene.positions.len() as u32;
    let geometries: Vec<[BlasGeometry; 1]> =
        groups.iter().map(|group| [geometry(positions, vertex_count, triangles, &group.range)]).collect();
    let descs: Vec<BlasDesc<'_>> = groups
        .iter()
        .zip(&geometries)
        .map(|(group, geometries)| BlasDesc { geometries, debug_name: group.name, ..BlasDesc::default() })
        .collect();
    let blas = ctx.create_blas_batch(&descs)?;
    let instances = groups.iter().zip(&blas).map(|(group, blas)| group.instance(**blas)).collect();
    Ok((blas, instances))
}

/// Triangles that share a structure.
struct Group {
    name: &'static str,
    range: Range<u32>,
    mask: u8,
    hit_group: u32,
}

impl Group {
    fn instance(&self, blas: AccelStructHandle) -> TlasInstance {
        TlasInstance {
            custom_index: self.range.start,
            mask: self.mask,
            hit_group_offset: self.hit_group,
            ..TlasInstance::new(blas)
        }
    }
}

fn geometry(
    vertex_buffer: BufferHandle,
    vertex_count: u32,
    triangles: BufferHandle,
    range: &Range<u32>,
) -> BlasGeometry {
    let offset = u64::from(range.start) * size_of::<[u32; 3]>() as u64;
    BlasGeometry::Triangles(Triangles {
        vertex_buffer,
        vertex_offset: 0,
        vertex_stride: 0,
        vertex_format: VertexFormat::F32x3,
        vertex_count,
        indices: Some(Indices { buffer: triangles, offset, format: IndexFormat::U32 }),
        triangle_count: range.end - range.start,
        transform: None,
        flags: GeometryFlags::OPAQUE,
    })
}
