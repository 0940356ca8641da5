//! Vertices that morph targets and joints move, by a compute shader, into the buffers that draws, rays and refits read.

use bytemuck::{Pod, Zeroable};
use glam::Mat4;
use lvk::{BufferHandle, BufferUsage, CommandBuffer, ComputePipelineHandle, Context, Dependencies, Holder};
use lvk_gltf::{Model, Pose, Primitive};
use lvk_samples::app::array_buffer::{array, buffer};

use super::instances::transform_rows;
use super::layout::GpuAttributes;
use crate::model::movers;
use crate::pipelines::{DEFORM, SAMPLE};

/// Invocations of a work group of `shaders/viewer/deform.comp.glsl`.
const GROUP: u32 = 64;
/// Bytes of a position.
pub(super) const POSITION: u64 = 12;

/// `RestVertex`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct RestVertex {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 4],
}

/// `Influence`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Influence {
    joints: [u16; 4],
    weights: [f32; 4],
}

/// `Delta`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Delta {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 3],
}

/// `TargetWeight`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TargetWeight {
    target: u32,
    weight: f32,
}

/// `Push`.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct DeformPush {
    rest: u64,
    influences: u64,
    deltas: u64,
    joints: u64,
    weights: u64,
    positions: u64,
    before: u64,
    attributes: u64,
    vertex_count: u32,
    set_count: u32,
    weight_count: u32,
    is_first: u32,
}

/// A geometry whose vertices move.
struct Part {
    node: usize,
    skin: Option<usize>,
    first_vertex: usize,
    vertex_count: usize,
    first_influence: usize,
    set_count: usize,
    first_delta: usize,
    target_count: usize,
    /// Places in the arrays that are written.
    first_position: usize,
    first_attributes: usize,
}

/// Vertices at rest while they are collected.
#[derive(Default)]
pub(super) struct RestArrays {
    vertices: Vec<RestVertex>,
    influences: Vec<Influence>,
    deltas: Vec<Delta>,
    parts: Vec<Part>,
}

impl RestArrays {
    /// Adds the triangles of a node. Their moved vertices have these places in the arrays of all geometries. Returns the place of
    /// the first one among the positions of the frame before.
    pub(super) fn add(
        &mut self,
        (model, node): (&Model, usize),
        primitive: &Primitive,
        [first_position, first_attributes]: [usize; 2],
    ) -> usize {
        let (first_vertex, vertex_count) = (self.vertices.len(), primitive.vertex_count());
        let skin = model.nodes.get(node).and_then(|node| node.skin);
        let set_count = if skin.is_some() { primitive.joints.len().min(primitive.weights.len()) } else { 0 };
        self.parts.push(Part {
            node,
            skin,
            first_vertex,
            vertex_count,
            first_influence: self.influences.len(),
            set_count,
            first_delta: self.deltas.len(),
            target_count: primitive.morph_targets.len(),
            first_position,
            first_attributes,
        });
        self.vertices.extend((0..vertex_count).map(|vertex| rest_vertex(primitive, vertex)));
        for (joints, weights) in primitive.joints.iter().zip(&primitive.weights).take(set_count) {
            let pairs = joints.iter().zip(weights);
            self.influences.extend(pairs.map(|(&joints, &weights)| Influence { joints, weights }));
        }
        for target in &primitive.morph_targets {
            let at = |list: &[[f32; 3]], vertex: usize| list.get(vertex).copied().unwrap_or_default();
            self.deltas.extend((0..vertex_count).map(|vertex| Delta {
                position: at(&target.positions, vertex),
                normal: at(&target.normals, vertex),
                tangent: at(&target.tangents, vertex),
            }));
        }
        first_vertex
    }
}

fn rest_vertex(primitive: &Primitive, vertex: usize) -> RestVertex {
    RestVertex {
        position: primitive.positions.get(vertex).unwrap_or_default(),
        normal: primitive.normals.get(vertex).copied().unwrap_or([0.0, 0.0, 1.0]),
        tangent: primitive.tangents.get(vertex).copied().unwrap_or_default(),
    }
}

/// The buffers that are written, which are those of all geometries, and their addresses.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovedArrays {
    pub(super) positions: (BufferHandle, u64),
    pub(super) attributes: (BufferHandle, u64),
}

/// Vertices that move.
pub(super) struct Deformation {
    parts: Vec<Part>,
    rest: Holder<BufferHandle>,
    influences: Holder<BufferHandle>,
    deltas: Holder<BufferHandle>,
    before: Holder<BufferHandle>,
    moved: MovedArrays,
    pipeline: Holder<ComputePipelineHandle>,
}

impl Deformation {
    /// Uploads vertices at rest; `None` if there are none.
    pub(super) fn new(ctx: &Context, rest: RestArrays, moved: MovedArrays) -> lvk::Result<Option<Self>> {
        let RestArrays { vertices, mut influences, mut deltas, parts } = rest;
        if vertices.is_empty() {
            return Ok(None);
        }
        // A buffer has at least one element.
        influences.push(Influence::zeroed());
        deltas.push(Delta::zeroed());
        Ok(Some(Self {
            parts,
            before: buffer(ctx, "positions before", POSITION * vertices.len() as u64)?,
            rest: array(ctx, "vertices at rest", BufferUsage::STORAGE, &vertices)?,
            influences: array(ctx, "influences of joints", BufferUsage::STORAGE, &influences)?,
            deltas: array(ctx, "morph targets", BufferUsage::STORAGE, &deltas)?,
            moved,
            pipeline: DEFORM.create_compute_pipeline(ctx, SAMPLE, &[])?,
        }))
    }

    /// Address of the positions of the frame before.
    pub(super) fn before_address(&self) -> lvk::Result<u64> {
        self.before.address()
    }

    /// Buffers that are written; draws and rays read them.
    pub(super) fn written(&self) -> [BufferHandle; 3] {
        [self.moved.positions.0, self.moved.attributes.0, *self.before]
    }

    /// Records the motion to a pose. The positions so far become those of the frame before, unless this is the first frame.
    pub(super) fn record(
        &self,
        cmd: &mut CommandBuffer,
        model: &Model,
        pose: &Pose,
        is_first: bool,
    ) -> lvk::Result<()> {
        cmd.bind_compute_pipeline(*self.pipeline)?;
        let mut joints: Vec<Option<u64>> = vec![None; pose.joints.len()];
        for part in &self.parts {
            let (weights, matrices) = movers(model, part.node, pose);
            let joints = match part.skin.and_then(|skin| joints.get_mut(skin)) {
                Some(Some(address)) => *address,
                Some(none) => *none.insert(upload_joints(cmd, matrices)?),
                None => 0,
            };
            let weights = active_weights(&weights[..weights.len().min(part.target_count)]);
            let weights_address = if weights.is_empty() { 0 } else { cmd.upload_slice(&weights)? };
            let push = DeformPush {
                joints,
                weights: weights_address,
                weight_count: weights.len() as u32,
                is_first: u32::from(is_first),
                set_count: if matrices.is_empty() { 0 } else { part.set_count as u32 },
                ..self.push(part)?
            };
            cmd.push_constants(&push)?;
            let written = self.written();
            let writes = Dependencies { buffers: &written, ..Dependencies::default() };
            cmd.dispatch([push.vertex_count.div_ceil(GROUP), 1, 1], &writes)?;
        }
        Ok(())
    }

    /// What of the constants is the same in every frame.
    fn push(&self, part: &Part) -> lvk::Result<DeformPush> {
        let place = |start: u64, size: usize, first: usize| start + (size * first) as u64;
        Ok(DeformPush {
            rest: place(self.rest.address()?, size_of::<RestVertex>(), part.first_vertex),
            influences: place(self.influences.address()?, size_of::<Influence>(), part.first_influence),
            deltas: place(self.deltas.address()?, size_of::<Delta>(), part.first_delta),
            positions: place(self.moved.positions.1, POSITION as usize, part.first_position),
            before: place(self.before.address()?, POSITION as usize, part.first_vertex),
            attributes: place(self.moved.attributes.1, size_of::<GpuAttributes>(), part.first_attributes),
            vertex_count: part.vertex_count as u32,
            ..Zeroable::zeroed()
        })
    }

    /// Reads the positions of the last frame, a list for each geometry that moves.
    pub(super) fn download(&self, ctx: &Context) -> lvk::Result<Vec<Vec<[f32; 3]>>> {
        let read = |part: &Part| {
            let mut positions = vec![[0.0_f32; 3]; part.vertex_count];
            let offset = POSITION * part.first_position as u64;
            ctx.download_buffer(self.moved.positions.0, offset, bytemuck::cast_slice_mut(&mut positions))?;
            Ok(positions)
        };
        self.parts.iter().map(read).collect()
    }
}

fn upload_joints(cmd: &mut CommandBuffer, matrices: &[Mat4]) -> lvk::Result<u64> {
    let none = [Mat4::ZERO];
    let matrices = if matrices.is_empty() { &none } else { matrices };
    cmd.upload_slice(&matrices.iter().map(transform_rows).collect::<Vec<_>>())
}

/// The targets whose weight is not 0.
fn active_weights(weights: &[f32]) -> Vec<TargetWeight> {
    let all = (0..).zip(weights).map(|(target, &weight)| TargetWeight { target, weight });
    all.filter(|target| target.weight != 0.0).collect()
}
