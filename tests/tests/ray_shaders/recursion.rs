//! Recursion on every path of ray tracing pipelines: a ray between two mirrors, against the same walk on the host.

use lvk::glam::{Affine3A, Vec3};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferUsage, Context, Dependencies, Error,
    HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, Result, ShaderStage, TlasDesc,
    TlasInstance, Triangles, record_bytes, transform_rows,
};
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::pipeline_paths::{lowered_devices, pipeline_devices};
use lvk_tests::ray_tracer::shader_with;

/// Deepest nesting of traces.
const DEPTH: u32 = 16;
/// Invocations of the launch.
const RAYS: u32 = 96;
/// The mirrors are squares at z = -1 and z = 1 that end at this x.
const EDGE: f32 = 10.03;
/// Factors of the two mirrors, in their records.
const WEIGHTS: [u32; 2] = [7, 12];

const SHARED: &str = "
    struct Path { uint value; float travelled; uint level; uint last; };
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint tlas; uint levels; };";

/// Ray `i` begins between the mirrors, and its path ends at the level 1 + `i` % `levels`.
const RAY_GEN: &str = "
    layout(location = 0) rayPayloadEXT Path path;
    void main() {
        uint i = gl_LaunchIDEXT.x;
        path = Path(0, 0.0, 1, 1 + i % levels);
        vec3 direction = vec3(float(i) / 256.0, 0, i % 2 == 0 ? 1 : -1);
        traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0, 0.3, 0), 0.0, direction, 1000.0, 0);
        words.at[2 * i] = path.value;
        words.at[2 * i + 1] = floatBitsToUint(path.travelled);
    }";

/// Uses values of before the trace behind the trace, and built-in ones, of which `KIND` is the hit kind.
const MIRROR: &str = "
    layout(location = 0) rayPayloadInEXT Path path;
    layout(location = 1) rayPayloadEXT Path inner;
    layout(shaderRecordEXT, scalar) buffer Record { uint weight; };
    void main() {
        uint kept = weight * path.level;
        uint kind = gl_HitKindEXT;
        inner = Path(0, 0.0, path.level + 1, path.last);
        if (path.level < path.last) {
            vec3 at = gl_WorldRayOriginEXT + gl_HitTEXT * gl_WorldRayDirectionEXT;
            vec3 mirrored = gl_WorldRayDirectionEXT * vec3(1, 1, -1);
            traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, at, 0.001, mirrored, 1000.0, 1);
        }
        path.value = kept + 3 * inner.value + uint(KIND == gl_HitKindFrontFacingTriangleEXT);
        path.travelled = inner.travelled + gl_HitTEXT * length(gl_WorldRayDirectionEXT);
    }";

/// Answers with the level of the ray.
const MISS: &str = "
    layout(location = 0) rayPayloadInEXT Path path;
    void main() { path.value = 100 + path.level; }";

/// Returns value and length of the path of ray `i` on the host, from `level` on, for a pipeline of this depth.
fn walk(i: u32, level: u32, (levels, depth): (u32, u32)) -> (u32, f64) {
    if level > depth {
        return (0, 0.0);
    }
    let slope = f64::from(i) / 256.0;
    // The first ray has half of the way to go.
    if slope * f64::from(2 * level - 1) > f64::from(EDGE) {
        return (100 + level, 0.0);
    }
    let is_upper = (i + level) % 2 == 1;
    let half = (slope * slope + 1.0).sqrt();
    let (inner, rest) = match level < 1 + i % levels {
        true => walk(i, level + 1, (levels, depth)),
        false => (0, 0.0),
    };
    let kept = WEIGHTS[usize::from(is_upper)] * level + u32::from(!is_upper);
    let travelled = half * if level == 1 { 1.0 } else { 2.0 };
    (kept.wrapping_add(inner.wrapping_mul(3)), travelled + rest)
}

/// Two mirrors, of one model, and a pipeline for them.
struct Mirrors<'a> {
    ctx: &'a Context,
    pipeline: Holder<RayTracingPipelineHandle>,
    _model: Holder<AccelStructHandle>,
    tlas: Holder<AccelStructHandle>,
}

/// Push constants of the shaders.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    words: u64,
    tlas: u32,
    levels: u32,
}

impl<'a> Mirrors<'a> {
    /// Compiles the pipeline for traces that nest `max_recursion` deep, and builds the mirrors.
    fn new(ctx: &'a Context, max_recursion: u32) -> Result<Self> {
        let pipeline = pipeline(ctx, max_recursion)?;
        let [a, b, c, d] = [[-EDGE, -1.0], [EDGE, -1.0], [EDGE, 1.0], [-EDGE, 1.0]].map(|[x, y]| [x, y, 0.0]);
        let vertices = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::bytes_of(&[a, b, c, a, c, d])),
            usage: BufferUsage::ACCEL_INPUT,
            ..Default::default()
        })?;
        let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 6))];
        let model = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?;
        let instances = [(0, -1.0), (1, 1.0)].map(|(hit_group_offset, z)| TlasInstance {
            transform: transform_rows(&Affine3A::from_translation(Vec3::Z * z)),
            hit_group_offset,
            ..TlasInstance::new(*model)
        });
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() })?;
        Ok(Self { ctx, pipeline, _model: model, tlas })
    }

    /// Asserts that paths of up to `levels` levels are those of the host, which stops below `depth` traces.
    fn assert_paths(&self, what: &str, levels: u32, depth: u32) -> Result<()> {
        let words = words_buffer(self.ctx, &[0; 2 * RAYS as usize]);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        cmd.bind_ray_tracing_pipeline(*self.pipeline)?;
        let address = self.ctx.buffer_address(*words)?;
        cmd.push_constants(&Push { words: address, tlas: self.tlas.index(), levels })?;
        cmd.trace_rays([RAYS, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() })?;
        self.ctx.submit(cmd)?;
        let words = read_words(self.ctx, *words, 2 * RAYS as usize);
        for (i, found) in (0..).zip(words.chunks_exact(2)) {
            let (value, length) = walk(i, 1, (levels, depth));
            let found_length = f64::from(f32::from_bits(found[1]));
            let is_near = (found_length - length).abs() < 1e-4 * (1.0 + length);
            assert!(
                found[0] == value && is_near,
                "{what}, ray {i}: {found_length}, {found:?}; must be {value}, {length}"
            );
        }
        Ok(())
    }
}

/// Compiles the pipeline for traces that nest `max_recursion` deep.
fn pipeline(ctx: &Context, max_recursion: u32) -> Result<Holder<RayTracingPipelineHandle>> {
    // lavapipe 25.0.7 has the hit kind of the inner ray behind the trace.
    let is_lowered = ctx.capabilities().ray_tracing_pipeline_path.is_lowered();
    let kind = [("KIND", if is_lowered { "gl_HitKindEXT" } else { "kind" })];
    let shader = |stage, text: &str| shader_with(ctx, stage, &format!("{SHARED}{text}"), &kind);
    let ray_gen = shader(ShaderStage::RayGen, RAY_GEN)?;
    let miss = shader(ShaderStage::Miss, MISS)?;
    let mirror = shader(ShaderStage::ClosestHit, MIRROR)?;
    let group =
        |weight| HitGroup { closest_hit: Some(*mirror), record: record_bytes(weight), ..Default::default() };
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[group(&WEIGHTS[0]), group(&WEIGHTS[1])],
        max_recursion,
        debug_name: "mirrors",
        ..Default::default()
    })
}

#[test]
fn paths_between_mirrors_are_those_of_the_host() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let depth = ctx.capabilities().limits.max_ray_recursion.min(DEPTH);
        if depth < DEPTH {
            eprintln!("NOT TESTED, {} nests {depth} traces only", ctx.capabilities().device_name);
        }
        Mirrors::new(&ctx, depth)?.assert_paths(&format!("{path:?}"), depth, depth)?;
    }
    Ok(())
}

/// Drivers may do anything then. A lowered pipeline returns from such a trace at once, and leaves the payload as it was.
#[test]
fn lowered_pipelines_return_from_traces_that_nest_too_deep() -> Result<()> {
    for (path, ctx) in lowered_devices() {
        for depth in [1, 5] {
            Mirrors::new(&ctx, depth)?.assert_paths(&format!("{path:?} to {depth}"), DEPTH, depth)?;
        }
    }
    Ok(())
}

#[test]
fn the_deepest_recursion_is_the_limit() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let limit = ctx.capabilities().limits.max_ray_recursion;
        assert!(!path.is_lowered() || limit == 31, "{path:?}: {limit}");
        Mirrors::new(&ctx, limit)?.assert_paths(&format!("{path:?} to {limit}"), limit, limit)?;
        let refused = pipeline(&ctx, limit + 1).map(drop);
        let Err(Error::LimitExceeded { what, object, requested, limit: named, .. }) = refused else {
            unreachable!("{path:?}: {refused:?}")
        };
        assert_eq!(
            (what, &*object, requested, named),
            ("recursion depth", "mirrors", u64::from(limit) + 1, limit.into())
        );
        let refused = pipeline(&ctx, 0).map(drop);
        assert!(matches!(refused, Err(Error::InvalidUsage { .. })), "{path:?}: {refused:?}");
    }
    Ok(())
}
