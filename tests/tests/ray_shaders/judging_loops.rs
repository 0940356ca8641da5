//! Any-hit and intersection shaders that end, or report, in each part of a loop, on every path of ray tracing pipelines.

use lvk::{
    Aabbs, AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, Context,
    Dependencies, GeometryFlags, HitGroup, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, Result,
    ShaderStage, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;

/// Rays of a launch. Shaders learn the index of theirs from `gl_LaunchIDEXT.x`.
const RAYS: u32 = 8;

/// Each ray ends at 5, and leaves its payload and the distance of its hit.
const RAY_GEN: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint tlas; };
    struct Payload { uint count; float distance; };
    layout(location = 0) rayPayloadEXT Payload payload;
    void main() {
        uint i = gl_LaunchIDEXT.x;
        payload = Payload(0, 0.0);
        traceRayEXT(kTLAS[tlas], gl_RayFlagsNoOpaqueEXT, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, vec3(0, 0, 1), 5.0, 0);
        words.at[2 * i] = payload.count;
        words.at[2 * i + 1] = floatBitsToUint(payload.distance);
    }";

const MISS: &str = "
    struct Payload { uint count; float distance; };
    layout(location = 0) rayPayloadInEXT Payload payload;
    void main() { payload.distance = -1.0; }";

const CLOSEST_HIT: &str = "
    struct Payload { uint count; float distance; };
    layout(location = 0) rayPayloadInEXT Payload payload;
    void main() { payload.distance = gl_HitTEXT; }";

/// Stands in front of judging shaders: `step` goes on to the next number, and ignores the candidate or ends the ray at the
/// number of the ray.
const ANY_HIT: &str = "
    struct Payload { uint count; float distance; };
    layout(location = 0) rayPayloadInEXT Payload payload;
    uint step(uint i) {
        if (i == gl_LaunchIDEXT.x / 2) {
            if (gl_LaunchIDEXT.x % 2 == 0) ignoreIntersectionEXT;
            terminateRayEXT;
        }
        return i + 1;
    }";

/// A triangle at z = 0, or a box around z = 0 to 9.
struct Scene {
    ctx: Context,
    _blas: Holder<AccelStructHandle>,
    tlas: Holder<AccelStructHandle>,
}

impl Scene {
    fn of_triangle(ctx: &Context) -> Result<Self> {
        let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        Self::new(ctx, &corners, |buffer| BlasGeometry::Triangles(Triangles::packed(buffer, 3)))
    }

    fn of_box(ctx: &Context) -> Result<Self> {
        let bounds = [0.0_f32, 0.0, 0.0, 1.0, 1.0, 9.0];
        let flags = GeometryFlags::empty();
        Self::new(ctx, &bounds, |buffer| {
            BlasGeometry::Aabbs(Aabbs { buffer, offset: 0, stride: 0, count: 1, flags })
        })
    }

    fn new(ctx: &Context, data: &[f32], geometry: impl Fn(BufferHandle) -> BlasGeometry) -> Result<Self> {
        let data = Some(bytemuck::cast_slice(data));
        let buffer =
            ctx.create_buffer(&BufferDesc { data, usage: BufferUsage::ACCEL_INPUT, ..Default::default() })?;
        let blas = ctx.create_blas(&BlasDesc { geometries: &[geometry(*buffer)], ..Default::default() })?;
        let instances = &[TlasInstance::new(*blas)];
        let tlas = ctx.create_tlas(&TlasDesc { instances, ..Default::default() })?;
        Ok(Self { ctx: ctx.clone(), _blas: blas, tlas })
    }

    /// Returns the count and the distance of each ray.
    fn run(&self, pipeline: RayTracingPipelineHandle) -> Result<Vec<(u32, f32)>> {
        #[repr(C)]
        #[derive(Clone, Copy, bytemuck::NoUninit)]
        struct Push {
            words: u64,
            tlas: u32,
            pad: u32,
        }
        let count = 2 * RAYS as usize;
        let words = words_buffer(&self.ctx, &vec![u32::MAX; count]);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        cmd.bind_ray_tracing_pipeline(pipeline)?;
        let address = self.ctx.buffer_address(*words)?;
        cmd.push_constants(&Push { words: address, tlas: self.tlas.index(), pad: 0 })?;
        let writes = Dependencies { buffers: &[*words], ..Default::default() };
        cmd.trace_rays([RAYS, 1, 1], &writes)?;
        self.ctx.submit(cmd)?;
        let found = read_words(&self.ctx, *words, count);
        Ok(found.as_chunks::<2>().0.iter().map(|[count, bits]| (*count, f32::from_bits(*bits))).collect())
    }
}

/// Returns a pipeline of one hit group with these shaders and the common ones.
fn pipeline(ctx: &Context, judging: &[(ShaderStage, &str)]) -> Result<Holder<RayTracingPipelineHandle>> {
    let ray_gen = shader(ctx, ShaderStage::RayGen, RAY_GEN)?;
    let miss = shader(ctx, ShaderStage::Miss, MISS)?;
    let closest_hit = shader(ctx, ShaderStage::ClosestHit, CLOSEST_HIT)?;
    let mut group = HitGroup { closest_hit: Some(*closest_hit), ..Default::default() };
    let mut modules = Vec::new();
    for (stage, text) in judging {
        let module = shader(ctx, *stage, text)?;
        match stage {
            ShaderStage::AnyHit => group.any_hit = Some(*module),
            _ => group.intersection = Some(*module),
        }
        modules.push(module);
    }
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[*ray_gen],
        miss: &[*miss],
        hit_groups: &[group],
        ..Default::default()
    })
}

/// The body of an any-hit shader, and the payload after `step` was called for 0 to `last`, and at the shader's end.
type AnyHitLoop = (&'static str, fn(u32) -> u32);

const ANY_HIT_LOOPS: [AnyHitLoop; 5] = [
    // The step of a loop, with `continue` and `break` inside of a switch.
    (
        "for (uint i = 0; i < 3; i = step(i)) {
             payload.count += 1;
             if (i == 1) continue;
             switch (i) { case 0: payload.count += 10; break; default: payload.count += 100; }
         }
         payload.count += 1000;",
        |last| [11, 12, 113, 1113][last.min(3) as usize],
    ),
    // The condition of a do-while loop.
    (
        "uint i = 0;
         do { payload.count += 1; i = step(i); } while (i < 3 && step(20 + i) > 0);
         payload.count += 1000;",
        |last| [1, 2, 3, 1003][last.min(3) as usize],
    ),
    (
        "uint i = 0;
         do { payload.count += 1; } while ((i = step(i)) < 3);
         payload.count += 1000;",
        |last| [1, 2, 3, 1003][last.min(3) as usize],
    ),
    // The condition of a while loop, which its header evaluates.
    (
        "uint i = 0;
         while ((i = step(i)) < 3) { payload.count += 1; }
         payload.count += 1000;",
        |last| [0, 1, 2, 1002][last.min(3) as usize],
    ),
    // A loop in the step of another.
    (
        "uint i = 0;
         for (; i < 3; payload.count += 1) { for (uint j = 0; j < 1; j++) { i = step(i); } }
         payload.count += 1000;",
        |last| [0, 1, 2, 1003][last.min(3) as usize],
    ),
];

#[test]
fn any_hit_shaders_end_in_every_part_of_a_loop() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let scene = Scene::of_triangle(&ctx)?;
        for (body, expected) in ANY_HIT_LOOPS {
            let text = format!("{ANY_HIT}\nvoid main() {{ {body} }}");
            let pipeline = pipeline(&ctx, &[(ShaderStage::AnyHit, &text)])?;
            let found = scene.run(*pipeline)?;
            for (ray, found) in (0..).zip(found) {
                let is_ignored = ray % 2 == 0 && ray / 2 < 3;
                let distance = if is_ignored { -1.0 } else { 1.0 };
                assert_eq!(found, (expected(ray / 2), distance), "{path:?}, ray {ray}: {body}");
            }
        }
    }
    Ok(())
}

/// The body of an intersection shader, and the distance of the hit. The ray ends at 5.
const INTERSECTION_LOOPS: [(&str, f32); 4] = [
    ("float t = 8.5; do { t -= 1.0; } while (!reportIntersectionEXT(t, 7u));", 4.5),
    ("float t = 8.5; while (!reportIntersectionEXT(t, 7u)) { t -= 1.0; }", 4.5),
    ("float t = 8.0; for (uint i = 0; i < 6; i += reportIntersectionEXT(t, 7u) ? 2 : 1) { t -= 1.0; }", 4.0),
    (
        "float t = 8.0;
         for (uint i = 0; i < 6; i++) {
             do { t -= 0.5; } while (tried(t) && t > 4.25);
             if (t < 3.5) break;
         }",
        3.0,
    ),
];

/// True unless the report is accepted.
const TRIED: &str = "bool tried(float t) { return !reportIntersectionEXT(t, 7u); }";

#[test]
fn intersection_shaders_report_in_every_part_of_a_loop() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let scene = Scene::of_box(&ctx)?;
        for (body, distance) in INTERSECTION_LOOPS {
            let text = format!("{TRIED}\nvoid main() {{ {body} }}");
            let own = pipeline(&ctx, &[(ShaderStage::Intersection, &text)])?;
            assert_eq!(scene.run(*own)?, [(0, distance); RAYS as usize], "{path:?}: {body}");
            // The first candidate ends the ray, and the shader with it.
            let any_hit = "void main() { terminateRayEXT; }";
            let ending =
                pipeline(&ctx, &[(ShaderStage::Intersection, &text), (ShaderStage::AnyHit, any_hit)])?;
            let first = if body.contains("8.5") { 4.5 } else { 5.0 };
            assert_eq!(scene.run(*ending)?, [(0, first); RAYS as usize], "{path:?}, ended: {body}");
        }
    }
    Ok(())
}
