//! The top-level structure: static instances that look large enough from the eye, and the animation things.

use glam::Vec3;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BuildMode, CommandBuffer, Context, Holder,
    InstanceCulling, TlasDesc, TlasInstance, transform_rows,
};

use super::animation::AnimationPasses;
use super::gpu_scene::GeometryArena;
use super::scene::HallScene;

/// `kMaskOpaque` in `shaders/reflections/masks.glsl`.
const MASK_OPAQUE: u8 = 1;
/// Mask bit of what light passes through.
const MASK_TRANSPARENT: u8 = 2;
/// The hit group with the any-hit shader of leaves.
const LEAF_HIT_GROUP: u32 = 1;

/// Number of instances in a frame's TLAS.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InstanceCount {
    /// Instances in the structure.
    pub kept: u32,
    /// Instances in the world.
    pub total: u32,
}

/// The top-level structure, and what it could show.
pub(super) struct TopLevel {
    pub(super) tlas: Holder<AccelStructHandle>,
    instances: Vec<Candidate>,
    animation: Vec<TlasInstance>,
    _blas: Vec<Holder<AccelStructHandle>>,
}

struct Candidate {
    instance: TlasInstance,
    /// Bounds in the space of the instance: all vertices are between -1 and 1.
    bounds: (Vec3, Vec3),
}

impl TopLevel {
    /// Builds a structure for each model, and has room for all instances.
    pub(super) fn new(
        ctx: &Context,
        world: &HallScene,
        arena: &GeometryArena,
        buffers: [BufferHandle; 2],
        animation: &AnimationPasses,
    ) -> lvk::Result<Self> {
        let blas = build_models(ctx, world, arena, buffers)?;
        let instances: Vec<Candidate> = (0..)
            .zip(&world.placed)
            .map(|(number, placed)| {
                let is_transparent = world.models[placed.model].is_transparent;
                let instance = TlasInstance {
                    transform: transform_rows(&(placed.to_world * arena.grid(placed.model).to_model())),
                    custom_index: number,
                    mask: if is_transparent { MASK_TRANSPARENT } else { MASK_OPAQUE },
                    ..TlasInstance::new(*blas[placed.model])
                };
                Candidate { instance, bounds: (Vec3::NEG_ONE, Vec3::ONE) }
            })
            .collect();
        let first = instances.len() as u32;
        let animation = [(*animation.serpent, 0), (*animation.leaves, LEAF_HIT_GROUP)];
        let animation: Vec<_> = (first..)
            .zip(animation)
            .map(|(custom_index, (blas, hit_group_offset))| TlasInstance {
                custom_index,
                mask: MASK_OPAQUE,
                hit_group_offset,
                ..TlasInstance::new(blas)
            })
            .collect();
        let capacity = first + animation.len() as u32;
        let tlas = ctx.create_tlas(&TlasDesc { capacity, debug_name: "hall tlas", ..TlasDesc::default() })?;
        Ok(Self { tlas, instances, animation, _blas: blas })
    }

    /// Records a build of what is seen from `eye` under `min_angle` radians or more, and of everything that moves.
    ///
    /// There is no test against the view frustum: mirrors show what is behind the viewer.
    pub(super) fn record(&self, cmd: &mut CommandBuffer, eye: Vec3, min_angle: f32) -> lvk::Result<()> {
        cmd.update_tlas(*self.tlas, &self.kept_instances(eye, min_angle), BuildMode::Rebuild)
    }

    /// Number of instances that [`record`](Self::record) puts into the TLAS.
    pub(super) fn count(&self, eye: Vec3, min_angle: f32) -> InstanceCount {
        let total = (self.instances.len() + self.animation.len()) as u32;
        InstanceCount { kept: self.kept_instances(eye, min_angle).len() as u32, total }
    }

    fn kept_instances(&self, eye: Vec3, min_angle: f32) -> Vec<TlasInstance> {
        let culling = InstanceCulling { eye: eye.to_array(), min_angle, ..InstanceCulling::default() };
        let keeps = |candidate: &&Candidate| {
            let (low, high) = candidate.bounds;
            culling.keeps_instance(low, high, &candidate.instance.transform)
        };
        let kept = self.instances.iter().filter(keeps).map(|candidate| candidate.instance);
        kept.chain(self.animation.iter().copied()).collect()
    }
}

/// A structure for each model, with a geometry for each of its materials.
fn build_models(
    ctx: &Context,
    world: &HallScene,
    arena: &GeometryArena,
    buffers: [BufferHandle; 2],
) -> lvk::Result<Vec<Holder<AccelStructHandle>>> {
    let geometries: Vec<Vec<BlasGeometry>> =
        (0..world.models.len()).map(|model| arena.geometries(model, buffers)).collect();
    let descs: Vec<BlasDesc<'_>> = world
        .models
        .iter()
        .zip(&geometries)
        .map(|(model, geometries)| BlasDesc { geometries, debug_name: model.name, ..BlasDesc::default() })
        .collect();
    ctx.create_blas_batch(&descs)
}
