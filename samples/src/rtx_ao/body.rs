//! Something that stands or turns in the scene: its arrays and its bottom-level structure on the GPU.

use bytemuck::{Pod, Zeroable};
use glam::{Affine3A, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, Context, GeometryFlags, Holder,
    IndexFormat, Indices, TextureHandle, Triangles, VertexFormat, transform_rows,
};

use crate::app::array_buffer::array;
use crate::app::scene_textures::{self, NO_TEXTURE};
use crate::scene::{Material, Scene};

/// `Body` in `shaders/rtx_ao/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct BodyConstants {
    rows: [f32; 12],
    /// Addresses of positions, normals, texture coordinates, triangles, paints and colours; the last may be 0.
    addresses: [u64; 6],
}

/// `Paint` in `shaders/rtx_ao/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Paint {
    albedo: [f32; 3],
    texture: u32,
}

/// The opaque triangles of a scene.
pub(super) struct Body {
    pub(super) blas: Holder<AccelStructHandle>,
    pub(super) triangle_count: u32,
    addresses: [u64; 6],
    _held: (Vec<Holder<BufferHandle>>, Vec<Holder<TextureHandle>>),
}

impl Body {
    pub(super) fn new(ctx: &Context, scene: &Scene) -> lvk::Result<Self> {
        let count = scene.opaque_triangle_count as usize;
        let textures: Vec<_> = scene
            .textures
            .iter()
            .map(|texture| scene_textures::picture(ctx, texture))
            .collect::<Result<_, _>>()?;
        let paint = |material: &u32| paint(&scene.materials[*material as usize], &textures);
        let paints: Vec<Paint> = scene.triangle_materials[..count].iter().map(paint).collect();
        let (read, input) = (BufferUsage::STORAGE, BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT);
        let mut buffers = vec![
            array(ctx, "positions", input, &scene.positions)?,
            array(ctx, "normals", read, &scene.normals)?,
            array(ctx, "texture coordinates", read, &scene.texcoords)?,
            array(ctx, "triangles", input, &scene.triangles[..count])?,
            array(ctx, "paints", read, &paints)?,
        ];
        if !scene.colors.is_empty() {
            buffers.push(array(ctx, "vertex colours", read, &scene.colors)?);
        }
        let mut addresses = [0; 6];
        for (address, buffer) in addresses.iter_mut().zip(&buffers) {
            *address = buffer.address()?;
        }
        let blas = build(ctx, scene, *buffers[0], *buffers[3])?;
        Ok(Self { blas, triangle_count: count as u32, addresses, _held: (buffers, textures) })
    }

    pub(super) fn constants(&self, place: &Affine3A) -> BodyConstants {
        BodyConstants { rows: transform_rows(place), addresses: self.addresses }
    }
}

fn build(
    ctx: &Context,
    scene: &Scene,
    vertex_buffer: BufferHandle,
    triangles: BufferHandle,
) -> lvk::Result<Holder<AccelStructHandle>> {
    let geometry = BlasGeometry::Triangles(Triangles {
        vertex_buffer,
        vertex_offset: 0,
        vertex_stride: 0,
        vertex_format: VertexFormat::F32x3,
        vertex_count: scene.positions.len() as u32,
        indices: Some(Indices { buffer: triangles, offset: 0, format: IndexFormat::U32 }),
        triangle_count: scene.opaque_triangle_count,
        transform: None,
        flags: GeometryFlags::OPAQUE,
    });
    ctx.create_blas(&BlasDesc { geometries: &[geometry], debug_name: &scene.name, ..BlasDesc::default() })
}

/// Nothing mirrors here, so mirrors have the colour that they give to what they show.
fn paint(material: &Material, textures: &[Holder<TextureHandle>]) -> Paint {
    let albedo = Vec3::from(material.albedo).lerp(0.8 * Vec3::from(material.tint), material.reflectivity);
    let texture = material.albedo_texture.map_or(NO_TEXTURE, |number| textures[number as usize].index());
    Paint { albedo: albedo.into(), texture }
}
