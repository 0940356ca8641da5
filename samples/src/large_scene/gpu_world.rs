//! A world on the GPU.

use crate::app::sample_error::SampleError;
use lvk::{
    AddressMode, BufferHandle, BufferUsage, Context, Holder, SamplerDesc, SamplerHandle, TextureHandle,
    transform_rows,
};

use super::LargeSceneConfig;
use super::figures::Figures;
use super::structure_cache::StructureCache;
use super::structures::{Plan, Structures};
use super::world::World;
use crate::app::array_buffer::array;
use crate::app::progress::Progress;
use crate::app::scene_textures;
use crate::hybrid::{SceneAddresses, SceneArrays, check_promises};

/// Texels on an edge of the sky's cube map.
const SKY_SIZE: u32 = 512;

/// A world on the GPU.
pub(super) struct GpuWorld {
    pub(super) figures: Figures,
    pub(super) sky: Holder<TextureHandle>,
    pub(super) surface_sampler: Holder<SamplerHandle>,
    pub(super) sky_sampler: Holder<SamplerHandle>,
    pub(super) structures: Structures,
    arrays: SceneArrays,
    places: Holder<BufferHandle>,
    firsts: Holder<BufferHandle>,
    _textures: Vec<Holder<TextureHandle>>,
}

impl GpuWorld {
    pub(super) fn new(
        ctx: &Context,
        world: &World,
        config: &LargeSceneConfig,
        progress: &mut Progress,
    ) -> Result<Self, SampleError> {
        check_promises(&world.scene)?;
        let textures = textures(ctx, world, progress)?;
        progress.stage("uploading the scene", 0);
        let arrays = SceneArrays::new(ctx, &world.scene, &textures)?;
        let rows: Vec<_> = world.instances.iter().map(|instance| transform_rows(&instance.place)).collect();
        let firsts: Vec<_> = world.pieces.iter().map(|piece| piece.triangles.start).collect();
        let sampler = |debug_name, address| {
            ctx.create_sampler(&SamplerDesc { address: [address; 3], debug_name, ..SamplerDesc::default() })
        };
        let cache = config.cache.as_deref().map(StructureCache::new);
        let plan = Plan { ctx, world, arrays: &arrays, cache, compact: config.compact };
        let structures = Structures::new(&plan, progress)?;
        Ok(Self {
            figures: figures(ctx, world, &structures)?,
            sky: scene_textures::sky(ctx, &world.scene.sky, SKY_SIZE)?,
            surface_sampler: sampler("surface sampler", AddressMode::Repeat)?,
            sky_sampler: sampler("sky sampler", AddressMode::ClampToEdge)?,
            structures,
            arrays,
            places: array(ctx, "places of instances", BufferUsage::STORAGE, &rows)?,
            firsts: array(ctx, "first triangles of pieces", BufferUsage::STORAGE, &firsts)?,
            _textures: textures,
        })
    }

    /// Addresses of the scene's arrays.
    pub(super) fn scene(&self) -> SceneAddresses {
        self.arrays.addresses()
    }

    /// Addresses of the transforms of instances and of the first triangles of pieces.
    pub(super) fn tables(&self) -> lvk::Result<[u64; 2]> {
        Ok([self.places.address()?, self.firsts.address()?])
    }
}

fn textures(
    ctx: &Context,
    world: &World,
    progress: &mut Progress,
) -> Result<Vec<Holder<TextureHandle>>, SampleError> {
    let textures = &world.scene.textures;
    progress.stage("uploading textures", textures.len() as u64);
    let mut made = Vec::with_capacity(textures.len());
    for texture in textures {
        progress.go_on()?;
        made.push(scene_textures::picture(ctx, texture)?);
        progress.set(made.len() as u64);
    }
    Ok(made)
}

fn figures(ctx: &Context, world: &World, structures: &Structures) -> lvk::Result<Figures> {
    let top_level = ctx.accel_struct_info(*structures.tlas)?;
    let scene = &world.scene;
    let vertex_bytes = 2 * size_of::<[f32; 3]>() + size_of::<[f32; 2]>();
    let triangle_bytes = size_of::<[u32; 3]>() + size_of::<[u32; 2]>();
    Ok(Figures {
        structures: structures.figures(ctx, world)?,
        triangles: world.triangle_count(),
        shown_triangles: world.instanced_triangle_count(),
        instances: world.instances.len(),
        scene_bytes: (scene.positions.len() * vertex_bytes + scene.triangles.len() * triangle_bytes) as u64,
        top_level_bytes: top_level.structure_bytes + top_level.table_bytes,
        scratch_bytes: ctx.accel_memory().scratch_bytes,
    })
}
