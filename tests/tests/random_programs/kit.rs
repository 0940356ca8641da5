//! Pipelines that the programs use.

use bytemuck::NoUninit;
use lvk::{
    ComputePipelineHandle, Context, Format, HitGroup, Holder, RayTracingPipelineDesc,
    RayTracingPipelineHandle, RenderPipelineDesc, RenderPipelineHandle, ShaderModuleDesc, ShaderSource,
    ShaderStage,
};
use lvk_tests::compute::compute_pipeline;
use lvk_tests::raster::render_pipeline;

use super::kit_draws::DrawKit;
use super::plan_pipelines::RayModules;

/// Push constants of every pipeline.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, NoUninit)]
pub struct Push {
    /// Address that is written.
    pub to: u64,
    /// Address that is read.
    pub from: u64,
    /// Bindless index of a texture or TLAS.
    pub index: u32,
    /// Seed of the pattern, or mip.
    pub number: u32,
    /// Word of the texel.
    pub word: u32,
    /// Bindless index of a sampler.
    pub sampler: u32,
}

pub(super) const HEAD: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words to; Words from; uint index; uint number; uint word; uint smp; };
    uint patternOf(uint i) { return (0x21 + (number + 7 * i) % 0x5d) * 0x01010101u; }
    uint hitWord(uint custom, uint triangle, float t) {
        uint depth = uint(t + 0.5);
        float off = abs(t - float(depth));
        return off < 0.01 ? 0x21212121u + custom + (triangle << 8) + (depth << 16) : 0u;
    }
    vec3 rayOrigin(uint i) { return vec3(float(4 * (i / 3) + i % 3) + 0.25, 0.25, 0.0); }
";

const QUERY: &str = "
    LvkRayQuery rq;
    lvkRayQueryInitialize(rq, index, 0, 0xff, rayOrigin(i), 0.0, vec3(0, 0, 1), 1000.0);
    while (lvkRayQueryProceed(rq)) {}
    to.at[i] = 0x7e7e7e7eu;
    if (lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE)
        to.at[i] = hitWord(lvkRayQueryInstanceCustomIndex(rq, LVK_COMMITTED),
                           lvkRayQueryPrimitiveIndex(rq, LVK_COMMITTED, index), lvkRayQueryT(rq, LVK_COMMITTED));
";

const RAY_GEN: &str = "
    layout(location = 0) rayPayloadEXT uint found;
    void main() {
        uint i = gl_LaunchIDEXT.x;
        found = 0x7e7e7e7eu;
        traceRayEXT(kTLAS[index], 0, 0xff, 0, 0, 0, rayOrigin(i), 0.0, vec3(0, 0, 1), 1000.0, 0);
        to.at[i] = found;
    }";

const CLOSEST_HIT: &str = "
    #include <lvk/ray_tracing.glsl>
    layout(location = 0) rayPayloadInEXT uint found;
    void main() { found = hitWord(gl_InstanceCustomIndexEXT, lvkPrimitiveIndex(index), gl_HitTEXT); }";

/// Compute pipelines of the programs, with one invocation for each word or texel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// Writes the pattern.
    Fill,
    /// Copies words.
    Copy,
    /// Writes a word to each texel of a texture of unsigned integers.
    StoreUint,
    /// Writes a word as a float to each texel.
    StoreFloat,
    /// Writes the four bytes of a word as channels to each texel.
    StoreBytes,
    /// Reads texels of unsigned integers.
    FetchUint,
    /// Reads texels of floats.
    FetchFloat,
    /// Reads the channels of texels as bytes.
    FetchBytes,
    /// Queries rays.
    Query,
    /// Samples texels of unsigned integers, as many textures to the right and below as `word` says, less one.
    SampleUint,
    /// Samples texels of floats.
    SampleFloat,
    /// Samples the channels of texels as bytes.
    SampleBytes,
}

/// Every kernel, in the order of [`Kernel`].
const KERNELS: [(&str, &str); 12] = [
    ("", "to.at[i] = patternOf(i);"),
    ("", "to.at[i] = from.at[i];"),
    ("", "imageStore(kImagesU2D[index], at, uvec4(word));"),
    ("", "imageStore(kImages2D[index], at, vec4(uintBitsToFloat(word)));"),
    ("", "imageStore(kImages2D[index], at, unpackUnorm4x8(word));"),
    ("", "to.at[flat] = texelFetch(kTexturesU2D[index], at, int(number)).x;"),
    ("", "to.at[flat] = floatBitsToUint(texelFetch(kTextures2D[index], at, int(number)).x);"),
    ("", "to.at[flat] = packUnorm4x8(texelFetch(kTextures2D[index], at, int(number)));"),
    ("#include <lvk/ray_query.glsl>\n", QUERY),
    ("", "to.at[flat] = textureLod(usampler2D(kTexturesU2D[index], kSamplers[smp]), uv, float(number)).x;"),
    ("", "to.at[flat] = floatBitsToUint(textureBindless2DLod(index, smp, uv, float(number)).x);"),
    ("", "to.at[flat] = packUnorm4x8(textureBindless2DLod(index, smp, uv, float(number)));"),
];

/// Formats that passes draw to.
pub const TARGETS: [Format; 3] = [Format::R32Uint, Format::R32Float, Format::Rgba8Unorm];

/// All pipelines.
pub struct Kit {
    kernels: Vec<Holder<ComputePipelineHandle>>,
    draws: Vec<Holder<RenderPipelineHandle>>,
    /// Pipelines of the other draws.
    pub draw_kit: DrawKit,
    trace: Option<Holder<RayTracingPipelineHandle>>,
    ray_modules: Option<RayModules>,
}

impl Kit {
    /// Creates the pipelines.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        let kernels = KERNELS.iter().map(|(before, body)| {
            let text = format!(
                "{before}{HEAD}
                 layout(local_size_x = 1) in;
                 void main() {{
                     uint i = gl_GlobalInvocationID.x;
                     ivec2 at = ivec2(gl_GlobalInvocationID.xy);
                     uint flat_ = at.y * gl_NumWorkGroups.x + at.x;
                     vec2 uv = (vec2(at) + 0.5) / vec2(gl_NumWorkGroups.xy) + float(word) - 1.0;
                     {}
                 }}",
                body.replace("flat", "flat_")
            );
            compute_pipeline(ctx, &text)
        });
        let kernels = kernels.collect();
        let draws = TARGETS.iter().map(|format| draw_pipeline(ctx, *format)).collect();
        let trace = ctx.capabilities().ray_tracing_pipeline.then(|| ray_pipeline(ctx)).transpose()?;
        let ray_modules =
            ctx.capabilities().ray_tracing_pipeline.then(|| RayModules::new(ctx)).transpose()?;
        Ok(Self { kernels, draws, draw_kit: DrawKit::new(ctx)?, trace, ray_modules })
    }

    /// Number of its objects.
    pub fn object_count(&self) -> usize {
        let modules = self.ray_modules.iter().map(|_| RayModules::COUNT).sum::<usize>();
        let draws = self.draws.len() + self.draw_kit.object_count();
        self.kernels.len() + draws + usize::from(self.trace.is_some()) + modules
    }

    /// Returns a compute pipeline.
    pub fn kernel(&self, kernel: Kernel) -> ComputePipelineHandle {
        *self.kernels[kernel as usize]
    }

    /// Returns the pipeline that draws to a format of [`TARGETS`].
    pub fn draw(&self, format: Format) -> RenderPipelineHandle {
        let index = TARGETS.iter().position(|target| *target == format).unwrap_or(0);
        *self.draws[index]
    }

    /// Returns the ray tracing pipeline, if the device has any.
    pub fn trace(&self) -> Option<RayTracingPipelineHandle> {
        self.trace.as_deref().copied()
    }

    /// Returns the shaders of pipelines that programs create, if the device has any.
    pub fn ray_modules(&self) -> Option<&RayModules> {
        self.ray_modules.as_ref()
    }
}

fn draw_pipeline(ctx: &Context, format: Format) -> Holder<RenderPipelineHandle> {
    let (kind, value) = match format {
        Format::R32Uint => ("uvec4", "uvec4(word)"),
        Format::R32Float => ("vec4", "vec4(uintBitsToFloat(word))"),
        _ => ("vec4", "unpackUnorm4x8(word)"),
    };
    let vertex = format!(
        "{HEAD} void main() {{
             vec2 corner = vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
             gl_Position = vec4(corner * 4.0 - 1.0, 0.5, 1.0);
         }}"
    );
    let fragment =
        format!("{HEAD} layout(location = 0) out {kind} result; void main() {{ result = {value}; }}");
    let desc = RenderPipelineDesc { color: &[format.into()], ..Default::default() };
    render_pipeline(ctx, &vertex, &fragment, &desc)
}

/// Creates a pipeline with one shader of each kind.
pub fn ray_pipeline(ctx: &Context) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
    let module = |stage, text: &str| {
        let text = format!("{HEAD}{text}");
        let source = ShaderSource::Glsl(&text);
        ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })
    };
    let ray_gen = module(ShaderStage::RayGen, RAY_GEN)?;
    let miss = "layout(location = 0) rayPayloadInEXT uint found; void main() {}";
    let miss = module(ShaderStage::Miss, miss)?;
    let closest_hit = module(ShaderStage::ClosestHit, CLOSEST_HIT)?;
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[HitGroup { closest_hit: Some(*closest_hit), ..Default::default() }],
        ..Default::default()
    })
}
