//! A compute shader that deforms the vertices of a mesh, and the same deformation on the CPU.

use bytemuck::NoUninit;
use lvk::{
    BufferHandle, CommandBuffer, ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Holder,
    Result, ShaderStage,
};

use crate::meshes::Mesh;
use crate::ray_tracer::shader;

/// Moves every vertex by its own amount, as [`deformed`] does.
const DEFORM: &str = r"
    layout(local_size_x = 64) in;
    layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Positions { vec3 at[]; };
    layout(push_constant, scalar) uniform Push { Positions positions; uint count; float amount; };
    void main() {
        uint index = gl_GlobalInvocationID.x;
        if (index < count) {
            vec3 p = positions.at[index];
            positions.at[index] = p + vec3(amount * p.y, amount, 0.5 * amount * p.x);
        }
    }";

#[repr(C)]
#[derive(Clone, Copy, NoUninit)]
struct Push {
    positions: u64,
    count: u32,
    amount: f32,
}

/// Moves packed vertices on the GPU.
pub struct VertexDeformer {
    ctx: Context,
    pipeline: Holder<ComputePipelineHandle>,
}

impl VertexDeformer {
    /// Compiles the shader.
    pub fn new(ctx: &Context) -> Result<Self> {
        let module = shader(ctx, ShaderStage::Compute, DEFORM)?;
        let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
        Ok(Self { ctx: ctx.clone(), pipeline: ctx.create_compute_pipeline(&desc)? })
    }

    /// Records the deformation of the vertices of `mesh`, which are packed in `buffer`.
    pub fn record(
        &self,
        cmd: &mut CommandBuffer,
        buffer: BufferHandle,
        mesh: &Mesh,
        amount: f32,
    ) -> Result<()> {
        let count = mesh.positions.len() as u32;
        cmd.bind_compute_pipeline(*self.pipeline)?;
        cmd.push_constants(&Push { positions: self.ctx.buffer_address(buffer)?, count, amount })?;
        let writes = Dependencies { buffers: &[buffer], ..Default::default() };
        cmd.dispatch([count.div_ceil(64), 1, 1], &writes)
    }
}

/// Returns the mesh as a [`VertexDeformer`] deforms it.
pub fn deformed(mesh: &Mesh, amount: f32) -> Mesh {
    let positions =
        mesh.positions.iter().map(|[x, y, z]| [x + amount * y, y + amount, z + 0.5 * amount * x]).collect();
    Mesh { positions, triangles: mesh.triangles.clone() }
}
