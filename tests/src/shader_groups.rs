//! A scene whose launches run each shader of a ray tracing pipeline once: hit groups, then miss shaders, then
//! callables.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, CommandBuffer, Context,
    Dependencies, Holder, RayTracingPipelineHandle, Result, ShaderModuleHandle, ShaderStage, TlasDesc,
    TlasInstance, Triangles, transform_rows,
};

use crate::compute::{read_words, words_buffer};
use crate::ray_tracer::shader_with;

/// Largest number of hit groups that [`GroupScene::run`] distinguishes.
pub const MOST_HIT_GROUPS: u32 = 8;

/// Launch `i` traces to instance `i`, which has hit group `i`. Later launches miss everything and run each miss
/// shader, and the last ones call each callable. `ADD` is added to the shader's result.
const RAY_GEN: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(location = 0) rayPayloadEXT uint value;
    layout(location = 0) callableDataEXT uint called;
    void main() {
        uint i = gl_LaunchIDEXT.x;
        if (i < hits + misses) {
            value = 0;
            vec3 origin = vec3(i + 0.25, 0.25, -1);
            vec3 direction = vec3(0, 0, i < hits ? 1 : -1);
            traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, i < hits ? 0 : i - hits, origin, 0.0, direction, 10.0, 0);
            results.at[i] = value + ADD;
        } else {
            called = 0;
            executeCallableEXT(i - hits - misses, 0);
            results.at[i] = called + ADD;
        }
    }";

/// Shader counts of a pipeline, those of its libraries included.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    /// Hit groups.
    pub hits: u32,
    /// Miss shaders.
    pub misses: u32,
    /// Callable shaders.
    pub callables: u32,
}

impl Counts {
    /// Returns the number of all shaders: the width of a launch that runs each.
    pub fn all(&self) -> u32 {
        self.hits + self.misses + self.callables
    }
}

/// Push constants of [`ray_gen`], and of other shaders that trace to each hit group and miss shader.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
pub struct Push {
    /// Address of the results.
    pub results: u64,
    /// Index of the TLAS.
    pub tlas: u32,
    /// Number of hit groups.
    pub hits: u32,
    /// Number of miss shaders.
    pub misses: u32,
    /// Padding, 0.
    pub pad: u32,
}

/// One triangle for each hit group, and the buffer of results.
pub struct GroupScene {
    ctx: Context,
    _model: Holder<AccelStructHandle>,
    tlas: Holder<AccelStructHandle>,
}

impl GroupScene {
    /// Builds the triangles.
    pub fn new(ctx: &Context) -> Result<Self> {
        let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::cast_slice(&corners)),
            usage: BufferUsage::ACCEL_INPUT,
            ..Default::default()
        })?;
        let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 3))];
        let model = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?;
        let place = |index: u32| TlasInstance {
            transform: transform_rows(&Affine3A::from_translation(Vec3::X * index as f32)),
            hit_group_offset: index,
            ..TlasInstance::new(*model)
        };
        let instances: Vec<_> = (0..MOST_HIT_GROUPS).map(place).collect();
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
        Ok(Self { ctx: ctx.clone(), _model: model, tlas })
    }

    /// Binds a pipeline whose ray generation shaders are [`ray_gen`]s, to write to `results`.
    pub fn bind(
        &self,
        cmd: &mut CommandBuffer,
        pipeline: RayTracingPipelineHandle,
        counts: Counts,
        results: BufferHandle,
    ) -> Result<()> {
        cmd.bind_ray_tracing_pipeline(pipeline)?;
        cmd.push_constants(&Push {
            results: self.ctx.buffer_address(results)?,
            tlas: self.tlas.index(),
            hits: counts.hits,
            misses: counts.misses,
            pad: 0,
        })
    }

    /// Returns the result of each shader of a pipeline, by ray generation shader `ray_gen`.
    pub fn run(&self, pipeline: RayTracingPipelineHandle, ray_gen: u32, counts: Counts) -> Result<Vec<u32>> {
        let results = words_buffer(&self.ctx, &vec![u32::MAX; counts.all() as usize]);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        self.bind(&mut cmd, pipeline, counts, *results)?;
        let writes = Dependencies { buffers: &[*results], ..Default::default() };
        cmd.trace_rays_with(ray_gen, [counts.all(), 1, 1], &writes)?;
        self.ctx.submit(cmd)?;
        Ok(read_words(&self.ctx, *results, counts.all() as usize))
    }
}

/// Creates a ray generation shader that adds the GLSL expression `add` to every result. `globals` go before it.
pub fn ray_gen(ctx: &Context, globals: &str, add: &str) -> Result<Holder<ShaderModuleHandle>> {
    shader_with(ctx, ShaderStage::RayGen, &format!("{globals}\n{RAY_GEN}"), &[("ADD", add)])
}

/// Creates a closest-hit, miss or callable shader whose result is the GLSL expression `answer`. `globals` go before
/// it.
pub fn answering(
    ctx: &Context,
    stage: ShaderStage,
    globals: &str,
    answer: &str,
) -> Result<Holder<ShaderModuleHandle>> {
    let variable = match stage {
        ShaderStage::Callable => "callableDataInEXT",
        _ => "rayPayloadInEXT",
    };
    let text = format!(
        "{globals}
         layout(location = 0) {variable} uint value;
         void main() {{ value = {answer}; }}"
    );
    shader_with(ctx, stage, &text, &[])
}
