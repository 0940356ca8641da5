//! Launches on every path of ray tracing pipelines: sizes, push constants, compute state, subgroups, constants.

use std::sync::Barrier;

use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, BufferUsage, CommandBuffer, Context, Dependencies, Error,
    Format, Holder, RayTracingPipelineDesc, RayTracingPipelineHandle, Result, ShaderStage,
    SpecializationConstant, SpecializationValue, TextureDesc, TextureRegion, TextureUsage, TlasDesc,
};
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;

/// Declarations of both shaders.
const WORDS: &str = "layout(buffer_reference, scalar) buffer Words { uint at[]; };";

/// Push constants of shaders that need no others.
const PUSH: &str = "layout(push_constant, scalar) uniform Push { Words words; uint tlas; uvec3 size; uint count; uint place; };";

/// Declarations of every ray generation shader: a ray into the empty scene runs the miss shader.
const START: &str = "
    layout(location = 0) rayPayloadEXT uint value;
    void trace(uint tlas) { traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0), 0.0, vec3(0, 0, 1), 9.0, 0); }";

/// Adds 1 to the payload.
const COUNTING_MISS: &str = "layout(location = 0) rayPayloadInEXT uint value; void main() { value += 1; }";

/// The values of [`PUSH`]; `more` are the size, the count and the place.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    words: u64,
    tlas: u32,
    more: [u32; 5],
}

/// A pipeline with one ray generation and one miss shader, and an empty scene.
struct Launcher<'a> {
    ctx: &'a Context,
    pipeline: Holder<RayTracingPipelineHandle>,
    tlas: Holder<AccelStructHandle>,
}

impl<'a> Launcher<'a> {
    /// Compiles a ray generation and a miss shader. `push` declares their push constants.
    fn new(
        ctx: &'a Context,
        push: &str,
        [ray_gen, miss]: [&str; 2],
        constants: &[SpecializationConstant],
    ) -> Result<Self> {
        let ray_gen = shader(ctx, ShaderStage::RayGen, &format!("{WORDS}{push}{START}{ray_gen}"))?;
        let miss = shader(ctx, ShaderStage::Miss, &format!("{WORDS}{push}{miss}"))?;
        let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            specialization: constants,
            ..Default::default()
        })?;
        let tlas = ctx.create_tlas(&TlasDesc { capacity: 1, ..Default::default() })?;
        Ok(Self { ctx, pipeline, tlas })
    }

    /// Binds the pipeline, and pushes the address of `words`, the scene and `more`.
    fn bind(&self, cmd: &mut CommandBuffer, words: BufferHandle, more: [u32; 5]) -> Result<()> {
        cmd.bind_ray_tracing_pipeline(*self.pipeline)?;
        cmd.push_constants(&Push { words: self.ctx.buffer_address(words)?, tlas: self.tlas.index(), more })
    }

    /// Returns the words after a launch that found `count` zeros there.
    fn run(&self, size: [u32; 3], more: [u32; 5], count: usize) -> Result<Vec<u32>> {
        let words = words_buffer(self.ctx, &vec![0; count]);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        self.bind(&mut cmd, *words, more)?;
        cmd.trace_rays(size, &Dependencies { buffers: &[*words], ..Default::default() })?;
        self.ctx.submit(cmd)?;
        Ok(read_words(self.ctx, *words, count))
    }
}

/// Each invocation adds 1 to its own word, by the way of a miss shader, and what is wrong to the last word.
#[test]
fn every_size_runs_each_invocation_once() -> Result<()> {
    const RAY_GEN: &str = "
        void main() {
            uvec3 id = gl_LaunchIDEXT;
            value = 0;
            trace(tlas);
            uint place = id.x + size.x * (id.y + size.y * id.z);
            bool isRight = gl_LaunchSizeEXT == size && all(lessThan(id, size));
            atomicAdd(words.at[isRight ? place : count], value);
        }";
    const SIZES: [[u32; 3]; 9] = [
        [1, 1, 1],
        [67, 1, 1],
        [1, 9, 1],
        [1, 1, 11],
        [13, 7, 1],
        [65, 2, 3],
        [5, 1, 6],
        [9, 17, 5],
        [0, 3, 1],
    ];
    for (path, ctx) in pipeline_devices() {
        let launcher = Launcher::new(&ctx, PUSH, [RAY_GEN, COUNTING_MISS], &[])?;
        for size in SIZES {
            let count = size.iter().product::<u32>();
            let [x, y, z] = size;
            let found = launcher.run(size, [x, y, z, count, 0], count as usize + 1)?;
            let expected: Vec<u32> = (0..=count).map(|place| u32::from(place < count)).collect();
            assert_eq!(found, expected, "{path:?}, {size:?}");
        }
    }
    Ok(())
}

/// The words behind the address and the scene, all that fit, are read before a trace, in the miss shader and behind the
/// trace. Two traces of one command buffer see their own.
#[test]
fn push_constants_of_the_largest_size_reach_every_shader_of_each_trace() -> Result<()> {
    const RAY_GEN: &str = "
        void main() {
            uint before = sum(0, 2);
            value = 5;
            trace(tlas);
            words.at[gl_LaunchIDEXT.x * 3] = before;
            words.at[gl_LaunchIDEXT.x * 3 + 1] = value;
            words.at[gl_LaunchIDEXT.x * 3 + 2] = sum(1, 3);
        }";
    const MISS: &str = "
        layout(location = 0) rayPayloadInEXT uint value;
        void main() { value += sum(0, 1) + more[more.length() - 1]; }";
    for (path, ctx) in pipeline_devices() {
        let bytes = ctx.capabilities().limits.max_push_constant_bytes.min(256) as usize;
        let count = bytes / 4 - 3;
        let push = format!(
            "layout(push_constant, scalar) uniform Push {{ Words words; uint tlas; uint more[{count}]; }};
             uint sum(uint first, uint step) {{
                 uint all = 0;
                 for (uint i = first; i < {count}; i += step) {{ all = all * 31 + more[i]; }}
                 return all;
             }}"
        );
        let launcher = Launcher::new(&ctx, &push, [RAY_GEN, MISS], &[])?;
        let sum = |more: &[u32], first: usize, step: usize| {
            more[first..]
                .iter()
                .step_by(step)
                .fold(0_u32, |all, word| all.wrapping_mul(31).wrapping_add(*word))
        };
        let results = [words_buffer(&ctx, &[0; 9]), words_buffer(&ctx, &[0; 9])];
        let mut expected = Vec::new();
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_ray_tracing_pipeline(*launcher.pipeline)?;
        for (number, words) in (1_u32..).zip(&results) {
            let more: Vec<u32> =
                (0..count as u32).map(|i| (i + 7 * number).wrapping_mul(2_654_435_761)).collect();
            let mut block = bytemuck::bytes_of(&ctx.buffer_address(**words)?).to_vec();
            block.extend(bytemuck::bytes_of(&launcher.tlas.index()));
            block.extend(bytemuck::cast_slice::<u32, u8>(&more));
            assert_eq!(block.len(), bytes);
            cmd.push_constant_bytes(0, &block)?;
            cmd.trace_rays([3, 1, 1], &Dependencies { buffers: &[**words], ..Default::default() })?;
            let miss = sum(&more, 0, 1).wrapping_add(more[count - 1]).wrapping_add(5);
            expected.push([sum(&more, 0, 2), miss, sum(&more, 1, 3)].repeat(3));
        }
        ctx.submit(cmd)?;
        let found = results.map(|words| read_words(&ctx, *words, 9));
        assert_eq!(found, *expected, "{path:?}");
    }
    Ok(())
}

/// An index of an image that is the same for all rays needs no `nonuniformEXT`, though rays end in different rounds of the
/// loop, those of the first lanes first.
#[test]
fn rays_that_end_early_write_their_own_texels() -> Result<()> {
    const RAY_GEN: &str = "
        void main() {
            value = 0;
            for (uint i = 0; i <= gl_LaunchIDEXT.x % 8; i++) { trace(tlas); }
            imageStore(kImages2D[place], ivec2(gl_LaunchIDEXT.xy), vec4(value));
        }";
    const SIZE: [u32; 2] = [64, 2];
    for (path, ctx) in pipeline_devices() {
        let image = ctx.create_texture(&TextureDesc {
            format: Format::R32Float,
            extent: SIZE,
            usage: TextureUsage::STORAGE,
            ..Default::default()
        })?;
        let launcher = Launcher::new(&ctx, PUSH, [RAY_GEN, COUNTING_MISS], &[])?;
        let words = words_buffer(&ctx, &[0]);
        let mut cmd = ctx.acquire_command_buffer()?;
        launcher.bind(&mut cmd, *words, [SIZE[0], SIZE[1], 1, 0, image.index()])?;
        let writes = Dependencies { storage_images: &[*image], ..Default::default() };
        cmd.trace_rays([SIZE[0], SIZE[1], 1], &writes)?;
        ctx.submit(cmd)?;
        let bytes = ctx.download_texture(*image, &TextureRegion::default())?;
        let expected: Vec<f32> = (0..SIZE[0] * SIZE[1]).map(|at| (at % 8 + 1) as f32).collect();
        assert_eq!(bytemuck::pod_collect_to_vec::<u8, f32>(&bytes), expected, "{path:?}");
    }
    Ok(())
}

/// A direct and an indirect trace run between three dispatches of a compute pipeline, which is bound once.
#[test]
fn compute_pipelines_stay_bound_across_traces() -> Result<()> {
    const COUNT: &str = "layout(local_size_x = 1) in; void main() { words.at[place] += 1; }";
    const RAY_GEN: &str = "
        void main() { value = 9; trace(tlas); words.at[place + 1] += value; }";
    for (path, ctx) in pipeline_devices() {
        let launcher = Launcher::new(&ctx, PUSH, [RAY_GEN, COUNTING_MISS], &[])?;
        let count = compute_pipeline(&ctx, &format!("{WORDS}{PUSH}{COUNT}"));
        let words = words_buffer(&ctx, &[0; 4]);
        let writes = Dependencies { buffers: &[*words], ..Default::default() };
        let size = Some(bytemuck::bytes_of(&[1_u32; 3]));
        let size = ctx.create_buffer(&BufferDesc {
            usage: BufferUsage::INDIRECT,
            data: size,
            ..Default::default()
        })?;
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_compute_pipeline(*count)?;
        launcher.bind(&mut cmd, *words, [0, 0, 0, 0, 2])?;
        cmd.dispatch([1, 1, 1], &writes)?;
        cmd.trace_rays([1, 1, 1], &writes)?;
        cmd.dispatch([1, 1, 1], &writes)?;
        if ctx.capabilities().trace_rays_indirect {
            cmd.trace_rays_indirect(0, *size, 0, &writes)?;
        } else {
            cmd.trace_rays([1, 1, 1], &writes)?;
        }
        cmd.dispatch([1, 1, 1], &writes)?;
        ctx.submit(cmd)?;
        assert_eq!(read_words(&ctx, *words, 4), [0, 0, 3, 20], "{path:?}");
    }
    Ok(())
}

/// Another thread destroys an object of the dependencies while an indirect trace is recorded. Whether the trace is
/// recorded or refused, the dispatch behind it runs the pipeline that was bound before.
#[test]
fn an_object_destroyed_beside_an_indirect_trace_leaves_the_compute_pipeline_bound() -> Result<()> {
    const COUNT: &str = "layout(local_size_x = 1) in; void main() { words.at[place] += 1; }";
    const RAY_GEN: &str = "
        void main() { value = 9; trace(tlas); words.at[place + 1] += value; }";
    const ROUNDS: u32 = 60;
    for (path, ctx) in pipeline_devices() {
        if !ctx.capabilities().trace_rays_indirect {
            eprintln!("NOT TESTED, {path:?} traces nothing indirectly");
            continue;
        }
        let launcher = Launcher::new(&ctx, PUSH, [RAY_GEN, COUNTING_MISS], &[])?;
        let count = compute_pipeline(&ctx, &format!("{WORDS}{PUSH}{COUNT}"));
        let usage = BufferUsage::INDIRECT;
        let data = Some(bytemuck::bytes_of(&[1_u32; 3]));
        let size = ctx.create_buffer(&BufferDesc { usage, data, ..Default::default() })?;
        let mut recorded = 0;
        for round in 0..ROUNDS {
            let victim = ctx.create_tlas(&TlasDesc { capacity: 1, ..Default::default() })?.release();
            let words = words_buffer(&ctx, &[0; 4]);
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.bind_compute_pipeline(*count)?;
            launcher.bind(&mut cmd, *words, [0, 0, 0, 0, 2])?;
            let uses =
                Dependencies { buffers: &[*words], acceleration_structures: &[victim], ..Default::default() };
            let (start, ctx) = (Barrier::new(2), &ctx);
            let traced = std::thread::scope(|scope| {
                scope.spawn(|| {
                    start.wait();
                    (0..40 * round).for_each(|_| std::hint::spin_loop());
                    ctx.destroy(victim);
                });
                start.wait();
                cmd.trace_rays_indirect(0, *size, 0, &uses)
            });
            cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() })?;
            ctx.submit(cmd)?;
            let value = match traced {
                Ok(()) => 10,
                Err(Error::StaleHandle { .. }) => 0,
                Err(other) => return Err(other),
            };
            recorded += u32::from(value > 0);
            assert_eq!(read_words(ctx, *words, 4), [0, 0, 1, value], "{path:?}, round {round}");
        }
        eprintln!("{path:?}: {recorded} of {ROUNDS} traces were recorded");
    }
    Ok(())
}

/// The invocations that run together are others on each path, but their sums add up to the same.
#[test]
fn sums_of_subgroups_add_up_to_the_launch() -> Result<()> {
    const RAY_GEN: &str = "
        void main() {
            uint id = gl_LaunchIDEXT.x + gl_LaunchSizeEXT.x * gl_LaunchIDEXT.y;
            uint ones = subgroupAdd(1u);
            if (subgroupElect()) { atomicAdd(words.at[0], ones); }
            if (id % 3 != 0) {
                uint ids = subgroupAdd(id);
                if (subgroupElect()) { atomicAdd(words.at[1], ids); }
            }
            value = id;
            trace(tlas);
            uint values = subgroupAdd(value);
            if (subgroupElect()) { atomicAdd(words.at[2], values); }
        }";
    for (path, ctx) in pipeline_devices() {
        let launcher = match Launcher::new(&ctx, PUSH, [RAY_GEN, COUNTING_MISS], &[]) {
            Err(Error::Unsupported { why, .. }) => {
                eprintln!("NOT TESTED, {path:?}: {why}");
                continue;
            }
            made => made?,
        };
        for size in [[131, 1, 1], [19, 11, 1]] {
            let ids = 0..size.iter().product::<u32>();
            let some: u32 = ids.clone().filter(|id| id % 3 != 0).sum();
            let all: u32 = ids.clone().map(|id| id + 1).sum();
            assert_eq!(launcher.run(size, [0; 5], 3)?, [ids.end, some, all], "{path:?}, {size:?}");
        }
    }
    Ok(())
}

/// Constants of the same id reach the shaders that declare them, sizes of arrays among them; others keep their defaults.
#[test]
fn specialization_constants_reach_every_shader() -> Result<()> {
    const RAY_GEN: &str = "
        layout(constant_id = 3) const uint kCount = 2;
        layout(constant_id = 4) const bool kDoubles = false;
        layout(constant_id = 5) const uint kDefault = 1000;
        const uint kSquare = kCount * kCount;
        void main() {
            uint kept[kCount];
            for (uint i = 0; i < kCount; ++i) { kept[i] = i + 1; }
            value = 0;
            trace(tlas);
            uint sum = kDefault + kSquare;
            for (uint i = 0; i < kCount; ++i) { sum += kept[i] * value; }
            words.at[0] = kDoubles ? 2 * sum : sum;
        }";
    const MISS: &str = "
        layout(constant_id = 3) const uint kCount = 2;
        layout(constant_id = 6) const float kWeight = 0.5;
        layout(location = 0) rayPayloadInEXT uint value;
        void main() { value = uint(kWeight * 10.0) + kCount; }";
    let constants = [
        SpecializationConstant { id: 3, value: SpecializationValue::U32(5) },
        SpecializationConstant { id: 4, value: SpecializationValue::Bool(true) },
        SpecializationConstant { id: 6, value: SpecializationValue::F32(1.25) },
    ];
    for (path, ctx) in pipeline_devices() {
        let run =
            |constants| Launcher::new(&ctx, PUSH, [RAY_GEN, MISS], constants)?.run([1, 1, 1], [0; 5], 1);
        assert_eq!(run(&[])?, [1000 + 4 + 3 * 7], "{path:?}, defaults");
        assert_eq!(run(&constants)?, [2 * (1000 + 25 + 15 * 17)], "{path:?}");
    }
    Ok(())
}
