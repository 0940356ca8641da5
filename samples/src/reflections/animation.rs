//! The animation: the serpent, skinned by compute into the buffer that its BLAS is refitted from, and the leaves,
//! turned to the camera by compute and built anew. Both happen in the command buffer that the rays are traced in.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildFlags, BuildMode,
    CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, GeometryFlags, Holder,
    PrimitiveOrder, Triangles,
};

use super::config::SkinUpdate;
use super::frame::{Push, words};
use super::gpu_scene::{GeometryArena, index_range};
use super::pipelines::{LEAVES, SKIN};
use super::quantise::pack_normal;
use super::serpent::{self, Skin};
use crate::app::array_buffer::array;
use crate::pipelines::SampleStage;

/// Invocations of a work group of both compute shaders.
const GROUP: u32 = 64;

/// `Push` in `shaders/reflections/skin.comp.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct SkinPush {
    rest: u64,
    bones: u64,
    positions: u64,
    normals: u64,
    vertex_count: u64,
}

/// A mesh of the serpent.
pub(super) struct SkinPart {
    pub(super) first_vertex: u32,
    vertex_count: u32,
    /// Places of the shared buffer of indices.
    pub(super) indices: Range<u32>,
}

/// The buffers of animation things.
pub(super) struct Animation {
    pub(super) skin_parts: Vec<SkinPart>,
    pub(super) skin_positions: u64,
    pub(super) skin_normals: u64,
    pub(super) leaf_positions: u64,
    pub(super) leaf_indices: Range<u32>,
    leaf_count: u32,
    rest: Holder<BufferHandle>,
    positions: Holder<BufferHandle>,
    normals: Holder<BufferHandle>,
    leaves: Holder<BufferHandle>,
    skin_vertex_count: u32,
}

/// The passes that move them, and their structures.
pub(super) struct AnimationPasses {
    skin: Holder<ComputePipelineHandle>,
    turn: Holder<ComputePipelineHandle>,
    pub(super) serpent: Holder<AccelStructHandle>,
    pub(super) leaves: Holder<AccelStructHandle>,
    skin_mode: BuildMode,
}

impl Animation {
    /// Buffers with the serpent at rest; its indices, and those of the leaves, go into `arena`.
    pub(super) fn new(ctx: &Context, arena: &mut GeometryArena, leaf_count: u32) -> lvk::Result<Self> {
        let skin = Skin::new();
        let rest = skin.rest_vertices();
        let mut first_vertex = 0;
        let mut skin_parts = Vec::new();
        for mesh in &skin.parts {
            let vertex_count = mesh.vertices.len() as u32;
            skin_parts.push(SkinPart {
                first_vertex,
                vertex_count,
                indices: arena.add_indices(&mesh.triangles),
            });
            first_vertex += vertex_count;
        }
        let quads: Vec<[u16; 3]> = (0..leaf_count as u16)
            .map(|leaf| 4 * leaf)
            .flat_map(|v| [[v, v + 1, v + 2], [v + 2, v + 1, v + 3]])
            .collect();
        let input = BufferUsage::STORAGE | BufferUsage::ACCEL_INPUT;
        let at_rest: Vec<[f32; 3]> = rest.iter().map(|vertex| vertex.position).collect();
        let packed: Vec<u32> = rest.iter().map(|vertex| pack_normal(vertex.normal.into())).collect();
        let positions = array(ctx, "skinned positions", input, &at_rest)?;
        let normals = array(ctx, "skinned normals", BufferUsage::STORAGE, &packed)?;
        let leaves = array(ctx, "leaf positions", input, &vec![[0.0_f32; 3]; 4 * leaf_count as usize])?;
        Ok(Self {
            skin_parts,
            skin_positions: positions.address()?,
            skin_normals: normals.address()?,
            leaf_positions: leaves.address()?,
            leaf_indices: arena.add_indices(&quads),
            leaf_count,
            rest: array(ctx, "skin at rest", BufferUsage::STORAGE, &rest)?,
            positions,
            normals,
            leaves,
            skin_vertex_count: rest.len() as u32,
        })
    }

    fn skin_geometries(&self, indices: BufferHandle) -> Vec<BlasGeometry> {
        let geometry = |part: &SkinPart| {
            BlasGeometry::Triangles(Triangles {
                vertex_offset: 12 * u64::from(part.first_vertex),
                indices: Some(index_range(indices, &part.indices)),
                triangle_count: (part.indices.end - part.indices.start) / 3,
                ..Triangles::packed(*self.positions, part.vertex_count)
            })
        };
        self.skin_parts.iter().map(geometry).collect()
    }

    /// Alpha-masked: its hits are asked about.
    fn leaf_geometry(&self, indices: BufferHandle) -> BlasGeometry {
        BlasGeometry::Triangles(Triangles {
            indices: Some(index_range(indices, &self.leaf_indices)),
            triangle_count: 2 * self.leaf_count,
            flags: GeometryFlags::NO_DUPLICATE_ANY_HIT,
            ..Triangles::packed(*self.leaves, 4 * self.leaf_count)
        })
    }

    /// Buffers that the compute shaders write; draws and rays read them in the same command buffer.
    pub(super) fn written(&self) -> [BufferHandle; 3] {
        [*self.positions, *self.normals, *self.leaves]
    }
}

impl AnimationPasses {
    pub(super) fn new(
        ctx: &Context,
        animation: &Animation,
        indices: BufferHandle,
        update: SkinUpdate,
    ) -> lvk::Result<Self> {
        let serpent = ctx.create_blas(&BlasDesc {
            geometries: &animation.skin_geometries(indices),
            flags: BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE,
            debug_name: "serpent",
            ..BlasDesc::default()
        })?;
        let leaves = ctx.create_blas(&BlasDesc {
            geometries: &[animation.leaf_geometry(indices)],
            flags: BuildFlags::FAST_BUILD,
            order: PrimitiveOrder::Given,
            debug_name: "leaves",
            ..BlasDesc::default()
        })?;
        let (skin, turn) = (compute(ctx, SKIN)?, compute(ctx, LEAVES)?);
        Ok(Self { skin, turn, serpent, leaves, skin_mode: mode(update) })
    }

    /// Sets the build mode of the serpent's structure.
    pub(super) fn set_skin_update(&mut self, update: SkinUpdate) {
        self.skin_mode = mode(update);
    }

    /// Compiles the pipelines again.
    pub(super) fn reload(&mut self, ctx: &Context) -> lvk::Result<()> {
        (self.skin, self.turn) = (compute(ctx, SKIN)?, compute(ctx, LEAVES)?);
        Ok(())
    }

    /// Records what moves everything to where it is at `phase` of the round, 0 to 1, and the builds that follow it. `frame`
    /// is the address of the frame's constants.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        animation: &Animation,
        phase: f32,
        frame: u64,
    ) -> lvk::Result<()> {
        cmd.push_label("skinning");
        cmd.bind_compute_pipeline(*self.skin)?;
        let bones = cmd.upload_slice(&serpent::bones(phase))?;
        cmd.push_constants(&SkinPush {
            rest: animation.rest.address()?,
            bones,
            positions: animation.skin_positions,
            normals: animation.skin_normals,
            vertex_count: animation.skin_vertex_count.into(),
        })?;
        let buffers = [*animation.positions, *animation.normals];
        let writes = Dependencies { buffers: &buffers, ..Dependencies::default() };
        cmd.dispatch([animation.skin_vertex_count.div_ceil(GROUP), 1, 1], &writes)?;
        cmd.pop_label();
        cmd.push_label("leaves");
        cmd.bind_compute_pipeline(*self.turn)?;
        let [low, high] = words(animation.leaf_positions);
        cmd.push_constants(&Push { frame, arguments: [low, high, animation.leaf_count, 0] })?;
        let writes = Dependencies { buffers: &[*animation.leaves], ..Dependencies::default() };
        cmd.dispatch([animation.leaf_count.div_ceil(GROUP), 1, 1], &writes)?;
        cmd.pop_label();
        cmd.build_blas(&[*self.serpent], self.skin_mode)?;
        cmd.build_blas(&[*self.leaves], BuildMode::Rebuild)
    }
}

fn mode(update: SkinUpdate) -> BuildMode {
    match update {
        SkinUpdate::Refit => BuildMode::Refit,
        SkinUpdate::Rebuild => BuildMode::Rebuild,
    }
}

/// A compute pipeline of one stage.
pub(super) fn compute(ctx: &Context, stage: SampleStage) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let module = stage.create(ctx, "reflections")?;
    ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        debug_name: stage.name,
        ..ComputePipelineDesc::default()
    })
}
