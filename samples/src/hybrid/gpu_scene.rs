//! A scene on the GPU: arrays, textures, sky and acceleration structures.

use crate::app::sample_error::SampleError;
use std::ops::Range;
use std::time::Instant;

use lvk::{
    AccelStructHandle, AddressMode, BlasDesc, BlasGeometry, BufferHandle, Context, Holder, SamplerDesc,
    SamplerHandle, TextureHandle, TlasDesc, TlasInstance,
};

use super::frame::SceneAddresses;
use super::scene_arrays::SceneArrays;
use super::scene_check::check;
use crate::app::scene_textures;
use crate::scene::Scene;

/// Mask bit of instances that stop light (`kMaskOpaque` in `shaders/hybrid/hit.glsl`).
const MASK_OPAQUE: u8 = 1;
/// Mask bit of instances that light passes through.
const MASK_REFRACTIVE: u8 = 2;
/// Texels on an edge of the sky's cube map.
const SKY_SIZE: u32 = 512;

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
    arrays: SceneArrays,
    _textures: Vec<Holder<TextureHandle>>,
    blas: Vec<Holder<AccelStructHandle>>,
}

/// Places of hit groups in the pipelines that trace the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct HitGroups {
    /// Hit group of opaque triangles.
    pub(crate) opaque: u32,
    /// Hit group of triangles that light passes through.
    pub(crate) refractive: u32,
}

impl GpuScene {
    /// Uploads `scene` and builds its acceleration structures.
    pub(crate) fn new(ctx: &Context, scene: &Scene, hit_groups: HitGroups) -> Result<Self, SampleError> {
        check(scene)?;
        let textures: Vec<_> = scene
            .textures
            .iter()
            .map(|texture| scene_textures::picture(ctx, texture))
            .collect::<Result<_, _>>()?;
        let arrays = SceneArrays::new(ctx, scene, &textures)?;
        ctx.wait_idle()?;
        let start = Instant::now();
        let (blas, instances) = build_blas(ctx, scene, hit_groups, &arrays)?;
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

    /// Addresses of the arrays.
    pub(crate) fn addresses(&self) -> SceneAddresses {
        self.arrays.addresses()
    }

    /// Vertex indices, three per triangle.
    pub(crate) fn triangles(&self) -> BufferHandle {
        self.arrays.triangles()
    }

    /// Number of BLASes: one for opaque and one for refractive triangles.
    pub(crate) fn blas_count(&self) -> usize {
        self.blas.len()
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
    arrays: &SceneArrays,
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
        groups.iter().map(|group| [arrays.geometry(&group.range, vertex_count)]).collect();
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
