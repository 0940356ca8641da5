//! A ray tracing pipeline that is reloaded when its shader's file changes, and others that come and go.

use std::fs;
use std::path::Path;
use std::time::Duration;

use lvk::{
    BufferDesc, BufferHandle, BufferUsage, Context, Dependencies, HitGroup, Holder, RayTracingPipelineDesc,
    RayTracingPipelineHandle, Reloadable, Result, ShaderFiles, ShaderModuleDesc, ShaderModuleHandle,
    ShaderRecord, ShaderStage,
};
use lvk_tests::compute::{module, read_words, words_buffer};
use tempfile::TempDir;

use super::run::Tally;
use super::scene::{Scene, instances};

/// One ray misses everything, the other hits the first instance.
const RAY_GEN: &str = "
    #include \"value.glsl\"
    layout(location = 0) rayPayloadEXT uint found;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; uint tlas; };
    void main() {
        uint i = gl_LaunchIDEXT.x;
        vec3 direction = vec3(0, 0, i == 0 ? -1 : 1);
        found = 0;
        traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.9, 1.45, -5), 0.0, direction, 1000.0, 0);
        words.at[i] = found + 100 * VALUE;
    }";

const MISS: &str = "
    layout(location = 0) rayPayloadInEXT uint found;
    layout(shaderRecordEXT, scalar) buffer Record { uint value; };
    void main() { found = value; }";

const CLOSEST_HIT: &str = "
    layout(location = 0) rayPayloadInEXT uint found;
    void main() { found = gl_InstanceCustomIndexEXT; }";

/// The value in the record of the miss shader.
const MISSED: u32 = 7;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::NoUninit)]
struct Push {
    words: u64,
    tlas: u32,
    unused: u32,
}

/// Pipelines, and what they write to.
pub struct Rays {
    reloaded: Reloadable<Holder<RayTracingPipelineHandle>>,
    value: u32,
    folder: TempDir,
    words: Holder<BufferHandle>,
    size: Holder<BufferHandle>,
}

impl Rays {
    /// Creates the pipeline. `None` if the device has none.
    #[expect(clippy::unwrap_used, reason = "a test whose files cannot be written has failed")]
    pub fn new(ctx: &Context) -> Result<Option<Self>> {
        if !ctx.capabilities().ray_tracing_pipeline {
            return Ok(None);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rays.rgen.glsl");
        fs::write(&path, RAY_GEN).unwrap();
        write_value(folder.path(), 1);
        let others = [(ShaderStage::Miss, MISS), (ShaderStage::ClosestHit, CLOSEST_HIT)]
            .map(|(stage, text)| module(ctx, stage, text));
        let build = move |ctx: &Context, files: &ShaderFiles| {
            let desc = ShaderModuleDesc { stage: ShaderStage::RayGen, ..Default::default() };
            let ray_gen = files.create_module(ctx, &path, &desc)?;
            pipeline(ctx, *ray_gen, [*others[0], *others[1]])
        };
        let size = BufferDesc {
            usage: BufferUsage::INDIRECT,
            data: Some(bytemuck::bytes_of(&[2_u32, 1, 1])),
            debug_name: "size of traces",
            ..Default::default()
        };
        Ok(Some(Self {
            reloaded: Reloadable::new(ctx, build)?.with_period(Duration::ZERO),
            value: 1,
            folder,
            words: words_buffer(ctx, &[0; 2]),
            size: ctx.create_buffer(&size)?,
        }))
    }

    /// Reloads and traces what is due in the frame of this phase, whose TLAS is built.
    pub fn frame(&mut self, ctx: &Context, scene: &Scene, phase: u32, tally: &mut Tally) -> Result<()> {
        let changes = phase % 125 == 60;
        if changes {
            // Texts of different lengths, as in `Churn`.
            self.value = if self.value == 1 { 22 } else { 1 };
            write_value(self.folder.path(), self.value);
        }
        assert_eq!(self.reloaded.poll()?, changes, "phase {phase}");
        if changes {
            tally.count("hot reloads of ray tracing pipelines");
        }
        if phase.is_multiple_of(5) {
            self.trace(ctx, scene, phase)?;
            tally.count("traces by pipelines");
        }
        if phase % 25 == 10 {
            let custom = instances(phase, [*scene.moving, *scene.fixed])[0].custom_index;
            let expected = [MISSED, custom].map(|found| found + 100 * self.value);
            assert_eq!(read_words(ctx, *self.words, 2), expected, "phase {phase}");
            tally.count("traces by pipelines compared");
        }
        Ok(())
    }

    fn trace(&self, ctx: &Context, scene: &Scene, phase: u32) -> Result<()> {
        let mut cmd = ctx.acquire_command_buffer()?;
        cmd.bind_ray_tracing_pipeline(**self.reloaded)?;
        let words = ctx.buffer_address(*self.words)?;
        cmd.push_constants(&Push { words, tlas: scene.tlas.index(), unused: 0 })?;
        let writes = Dependencies {
            buffers: &[*self.words],
            acceleration_structures: &[*scene.tlas],
            ..Default::default()
        };
        if phase.is_multiple_of(2) && ctx.capabilities().trace_rays_indirect {
            cmd.trace_rays_indirect(0, *self.size, 0, &writes)?;
        } else {
            cmd.trace_rays([2, 1, 1], &writes)?;
        }
        ctx.submit(cmd)?;
        Ok(())
    }
}

#[expect(clippy::unwrap_used, reason = "a test whose files cannot be written has failed")]
fn write_value(folder: &Path, value: u32) {
    fs::write(folder.join("value.glsl"), format!("#define VALUE {value}")).unwrap();
}

fn pipeline(
    ctx: &Context,
    ray_gen: ShaderModuleHandle,
    [miss, closest_hit]: [ShaderModuleHandle; 2],
) -> Result<Holder<RayTracingPipelineHandle>> {
    ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
        ray_gen: &[ray_gen],
        miss: &[miss],
        miss_records: &[ShaderRecord::from_bytes(bytemuck::bytes_of(&MISSED))],
        hit_groups: &[HitGroup { closest_hit: Some(closest_hit), ..Default::default() }],
        debug_name: "reloaded rays",
        ..Default::default()
    })
}
