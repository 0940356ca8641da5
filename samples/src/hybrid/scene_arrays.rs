//! The arrays of a scene on the GPU.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use lvk::{
    BlasGeometry, BufferHandle, BufferUsage, Context, GeometryFlags, Holder, IndexFormat, Indices,
    TextureHandle, Triangles, VertexFormat,
};

use super::frame::SceneAddresses;
use super::texture_density::lod_constant;
use crate::app::array_buffer::array;
use crate::app::scene_textures::NO_TEXTURE;
use crate::scene::{Material, Scene};

/// Buffers of a scene that shaders read by address.
pub(crate) struct SceneArrays {
    positions: Holder<BufferHandle>,
    triangles: Holder<BufferHandle>,
    _held: ([Holder<BufferHandle>; 4], Option<Holder<BufferHandle>>),
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

impl SceneArrays {
    /// Uploads everything of `scene` but its `textures`, which materials refer to.
    pub(crate) fn new(ctx: &Context, scene: &Scene, textures: &[Holder<TextureHandle>]) -> lvk::Result<Self> {
        let infos: Vec<_> = (0..scene.triangles.len()).map(|i| triangle_info(scene, i)).collect();
        let materials: Vec<_> = scene.materials.iter().map(|m| gpu_material(m, textures)).collect();

        let read = BufferUsage::STORAGE;
        let caps = ctx.capabilities();
        let traces = caps.ray_tracing_pipeline || caps.ray_query;
        let input = if traces { read | BufferUsage::ACCEL_INPUT } else { read };
        let positions = array(ctx, "scene positions", input, &scene.positions)?;
        let normals = array(ctx, "scene normals", read, &scene.normals)?;
        let texcoords = array(ctx, "scene texture coordinates", read, &scene.texcoords)?;
        let triangles = array(ctx, "scene triangles", input | BufferUsage::INDEX, &scene.triangles)?;
        let triangle_infos = array(ctx, "scene triangle infos", read, &infos)?;
        let materials = array(ctx, "scene materials", read, &materials)?;
        let has_colors = !scene.colors.is_empty();
        let colors =
            has_colors.then(|| array(ctx, "scene vertex colours", read, &scene.colors)).transpose()?;
        let addresses = SceneAddresses {
            positions: positions.address()?,
            normals: normals.address()?,
            texcoords: texcoords.address()?,
            triangles: triangles.address()?,
            triangle_infos: triangle_infos.address()?,
            materials: materials.address()?,
            colors: address_words(colors.as_ref())?,
        };
        let held = ([normals, texcoords, triangle_infos, materials], colors);
        Ok(Self { positions, triangles, _held: held, addresses })
    }

    /// Addresses of the arrays.
    pub(crate) fn addresses(&self) -> SceneAddresses {
        self.addresses
    }

    /// Vertex indices, three per triangle.
    pub(crate) fn triangles(&self) -> BufferHandle {
        self.triangles.handle()
    }

    /// A range of triangles, for a bottom-level structure; none of them names a vertex from `vertex_count` on.
    pub(crate) fn geometry(&self, range: &Range<u32>, vertex_count: u32) -> BlasGeometry {
        let offset = u64::from(range.start) * size_of::<[u32; 3]>() as u64;
        BlasGeometry::Triangles(Triangles {
            vertex_buffer: *self.positions,
            vertex_offset: 0,
            vertex_stride: 0,
            vertex_format: VertexFormat::F32x3,
            vertex_count,
            indices: Some(Indices { buffer: *self.triangles, offset, format: IndexFormat::U32 }),
            triangle_count: range.end - range.start,
            transform: None,
            flags: GeometryFlags::OPAQUE,
        })
    }
}

/// The lower and the upper half of a buffer's address; 0 without a buffer.
fn address_words(buffer: Option<&Holder<BufferHandle>>) -> lvk::Result<[u32; 2]> {
    let address = buffer.map_or(Ok(0), |buffer| buffer.address())?;
    Ok([address as u32, (address >> 32) as u32])
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
