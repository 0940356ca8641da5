//! Objects that come and go while frames run, each kind in its own rhythm, all of which divide the cycle.

use std::collections::VecDeque;
use std::fs;
use std::time::Duration;

use lvk::{
    AccelStructHandle, BufferDesc, BufferHandle, BuildFlags, ClearValue, Compaction, ComputePipelineDesc,
    ComputePipelineHandle, Context, Error, Format, Holder, PendingPipeline, QueryPoolDesc, QueryPoolHandle,
    Reloadable, RenderPipelineDesc, RenderPipelineHandle, Result, SamplerDesc, ShaderFiles, ShaderModuleDesc,
    ShaderModuleHandle, ShaderStage, SpecializationConstant, SpecializationValue, TextureDesc, TextureHandle,
    TextureRange, TextureRegion, TextureUsage, TextureViewDesc, TransientHeap, TransientHeapDesc,
    TransientTexture,
};
use lvk_tests::compute::{module, run_on_words};
use lvk_tests::raster::{COVER, PAINT};
use tempfile::TempDir;

use super::frame::Sampled;
use super::run::Tally;
use super::scene::{Scene, blas, mesh_buffer};

/// Mips of a streamed texture of 32x32 texels.
const MIPS: u32 = 6;
/// Frames between two streamed textures, and the mips that are uploaded meanwhile.
const STREAM: u32 = 5;
/// Streamed textures that are alive; the oldest is unloaded.
const MOST_TEXTURES: usize = 4;

const WRITE: &str = "
    layout(local_size_x = 1) in;
    layout(constant_id = 0) const uint value = 1;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = value; }";

const RELOADED: &str = "
    #include \"value.glsl\"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = VALUE; }";

/// A mesh that lives for twenty frames.
struct Visitor {
    structure: Holder<AccelStructHandle>,
    _vertices: Holder<BufferHandle>,
}

/// Everything that comes and goes.
pub struct Churn {
    textures: VecDeque<Holder<TextureHandle>>,
    finest_mip: u32,
    visitor: Option<Visitor>,
    write: Holder<ShaderModuleHandle>,
    paint: [Holder<ShaderModuleHandle>; 2],
    compute: Option<PendingPipeline<ComputePipelineHandle>>,
    render: Option<PendingPipeline<RenderPipelineHandle>>,
    queries: Option<Holder<QueryPoolHandle>>,
    transient: Option<TransientHeap>,
    reloaded: Reloadable<Holder<ComputePipelineHandle>>,
    value: u32,
    folder: TempDir,
}

impl Churn {
    /// Creates the objects that last, and the first texture.
    #[expect(clippy::unwrap_used, reason = "a test whose files cannot be written has failed")]
    pub fn new(ctx: &Context) -> Result<Self> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("write.comp.glsl");
        fs::write(&path, RELOADED).unwrap();
        fs::write(folder.path().join("value.glsl"), "#define VALUE 1").unwrap();
        let build = move |ctx: &Context, files: &ShaderFiles| {
            let desc = ShaderModuleDesc { stage: ShaderStage::Compute, ..Default::default() };
            let module = files.create_module(ctx, &path, &desc)?;
            ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
        };
        Ok(Self {
            textures: VecDeque::new(),
            finest_mip: MIPS,
            visitor: None,
            write: module(ctx, ShaderStage::Compute, WRITE),
            paint: [module(ctx, ShaderStage::Vertex, COVER), module(ctx, ShaderStage::Fragment, PAINT)],
            compute: None,
            render: None,
            queries: None,
            transient: None,
            reloaded: Reloadable::new(ctx, build)?.with_period(Duration::ZERO),
            value: 1,
            folder,
        })
    }

    /// Does what is due before the frame of this phase is recorded. Returns the texture to sample.
    pub fn before_frame(
        &mut self,
        ctx: &Context,
        scene: &mut Scene,
        phase: u32,
        tally: &mut Tally,
    ) -> Result<Sampled> {
        self.stream(ctx, phase, tally)?;
        self.visit(ctx, phase, tally)?;
        self.pipelines(ctx, phase, tally)?;
        self.reload(ctx, phase, tally)?;
        self.transient(ctx, phase, tally)?;
        self.profile(ctx, phase, tally)?;
        if phase % 50 == 45 {
            scene.renew_tlas(ctx, phase)?;
            tally.count("TLAS created and destroyed");
        }
        if phase.is_multiple_of(10) {
            small_objects(ctx, *scene.target, phase, tally)?;
        }
        let Some(texture) = self.textures.back() else { unreachable!("a texture was just streamed") };
        Ok(Sampled { texture: **texture, index: texture.index(), finest_mip: self.finest_mip })
    }

    /// Creates a texture every fifth frame, uploads a mip of it in each frame, and unloads the oldest texture.
    fn stream(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        if phase.is_multiple_of(STREAM) {
            let desc = TextureDesc {
                format: Format::Rgba8Unorm,
                extent: [32, 32],
                mips: MIPS,
                usage: TextureUsage::SAMPLED,
                debug_name: "streamed",
                ..Default::default()
            };
            self.textures.push_back(ctx.create_texture(&desc)?);
            self.finest_mip = MIPS;
            tally.count("textures created");
            if self.textures.len() > MOST_TEXTURES
                && let Some(oldest) = self.textures.pop_front()
            {
                let stale = *oldest;
                drop(oldest);
                expect_stale(ctx.download_texture(stale, &TextureRegion::default()), tally);
                tally.count("textures unloaded");
            }
        }
        self.finest_mip -= 1;
        let side = 32_u32 >> self.finest_mip;
        let texel = |at: u32| [at * 8 + phase, at * 3, phase * 5 + at / 32, 255].map(|channel| channel as u8);
        let texels: Vec<u8> = (0..side * side).flat_map(texel).collect();
        let Some(texture) = self.textures.back() else { return Ok(()) };
        let region = TextureRegion { mip: self.finest_mip, ..Default::default() };
        ctx.upload_texture(**texture, &region, &texels)?;
        tally.count("mips streamed");
        Ok(())
    }

    /// A mesh that is created, compacted and destroyed.
    fn visit(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        match phase % 25 {
            0 => {
                let vertices = mesh_buffer(ctx, phase)?;
                let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
                let structure = blas(ctx, *vertices, flags)?;
                ctx.compact(&[*structure])?;
                tally.count("BLAS created and destroyed");
                self.visitor = Some(Visitor { structure, _vertices: vertices });
            }
            20 => {
                let Some(visitor) = self.visitor.take() else { return Ok(()) };
                match ctx.accel_struct_info(*visitor.structure)?.compaction {
                    Compaction::Done { .. } => tally.count("compactions"),
                    Compaction::Pending => tally.count("compactions ended by destruction"),
                    other => unreachable!("the compaction is {other:?}"),
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Compiles pipelines in the background, uses them, and destroys them.
    fn pipelines(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        match phase % 50 {
            5 => {
                let specialization =
                    &[SpecializationConstant { id: 0, value: SpecializationValue::U32(phase + 1) }];
                let module = Some(*self.write);
                let desc = ComputePipelineDesc { module, specialization, ..Default::default() };
                self.compute = Some(ctx.create_compute_pipeline_in_background(&desc)?);
            }
            15 => {
                let Some(pending) = self.compute.take() else { return Ok(()) };
                let pipeline = pending.wait()?;
                assert_eq!(run_on_words(ctx, *pipeline, &[0]), [phase - 10 + 1]);
                tally.count("compute pipelines compiled in the background and destroyed");
            }
            30 => {
                let [vertex, fragment] = [&self.paint[0], &self.paint[1]].map(|module| Some(**module));
                let color = &[Format::Rgba8Unorm.into()];
                let desc = RenderPipelineDesc { vertex, fragment, color, ..Default::default() };
                self.render = Some(ctx.create_render_pipeline_in_background(&desc)?);
            }
            40 => {
                let Some(pending) = self.render.take() else { return Ok(()) };
                let pipeline = pending.wait()?;
                ctx.raw_render_pipeline(*pipeline)?;
                tally.count("render pipelines compiled in the background and destroyed");
            }
            _ => {}
        }
        Ok(())
    }

    /// Changes the file of a shader twice in a cycle, and runs what it was compiled to.
    #[expect(clippy::unwrap_used, reason = "a test whose files cannot be written has failed")]
    fn reload(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        let changes = phase % 125 == 110;
        if changes {
            // Texts of different lengths: a change shows whatever the resolution of the file's time.
            self.value = if self.value == 1 { 22 } else { 1 };
            let text = format!("#define VALUE {}", self.value);
            fs::write(self.folder.path().join("value.glsl"), text).unwrap();
        }
        assert_eq!(self.reloaded.poll()?, changes, "phase {phase}");
        if changes {
            tally.count("hot reloads");
        }
        if phase % 25 == 12 {
            assert_eq!(run_on_words(ctx, **self.reloaded, &[0]), [self.value]);
        }
        Ok(())
    }

    /// Textures that share memory, in a heap that is made anew with another size.
    fn transient(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        if phase % 125 == 7 || self.transient.is_none() {
            let extent = if phase < 125 { [32, 16] } else { [48, 24] };
            let desc = TextureDesc {
                format: Format::Rgba8Unorm,
                extent,
                usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
                debug_name: "transient",
                ..Default::default()
            };
            let textures = [0, 1].map(|step| TransientTexture { desc, first_step: step, last_step: step });
            self.transient = None;
            let heap =
                TransientHeapDesc { textures: &textures, debug_name: "transient", ..Default::default() };
            self.transient = Some(ctx.create_transient_heap(&heap)?);
            tally.count("transient heaps created and destroyed");
        }
        let Some(heap) = self.transient.as_ref().filter(|_| phase.is_multiple_of(5)) else { return Ok(()) };
        let mut cmd = ctx.acquire_command_buffer()?;
        for (step, texture) in (0..).zip(heap.textures()) {
            cmd.begin_transient_step(heap, step)?;
            cmd.clear_texture(**texture, ClearValue::Color([0.5; 4]), &TextureRange::default())?;
            tally.count("transient targets used");
        }
        ctx.submit(cmd)?;
        Ok(())
    }

    /// Profiles ten frames of a cycle, and keeps a pool of timestamps for twenty.
    fn profile(&mut self, ctx: &Context, phase: u32, tally: &mut Tally) -> Result<()> {
        match phase {
            100 => ctx.set_profiling(true)?,
            101..110 => tally.count("frames with the profiler"),
            110 => {
                ctx.wait_idle()?;
                assert!(ctx.last_profile()?.is_some(), "ten frames were profiled");
                ctx.set_profiling(false)?;
            }
            200 => {
                self.queries = Some(ctx.create_query_pool(&QueryPoolDesc { count: 2, ..Default::default() })?)
            }
            201..220 => {
                let Some(pool) = self.queries.as_deref().copied() else { return Ok(()) };
                let mut cmd = ctx.acquire_command_buffer()?;
                cmd.reset_queries(pool, 0..2)?;
                cmd.write_timestamp(pool, phase % 2)?;
                ctx.submit(cmd)?;
                tally.count("timestamps");
            }
            220 => self.queries = None,
            _ => {}
        }
        Ok(())
    }
}

/// Creates and destroys a buffer, a sampler and a view, and uses their handles once more.
fn small_objects(ctx: &Context, target: TextureHandle, phase: u32, tally: &mut Tally) -> Result<()> {
    let bytes = [phase as u8; 600];
    let buffer = ctx.create_buffer(&BufferDesc { data: Some(&bytes), ..Default::default() })?;
    let other = ctx.create_buffer(&BufferDesc { size_bytes: 600, ..Default::default() })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.copy_buffer(*buffer, 0, *other, 0, 600)?;
    ctx.submit(cmd)?;
    let sampler = ctx.create_sampler(&SamplerDesc::default())?;
    let view = ctx.create_texture_view(&TextureViewDesc { texture: Some(target), ..Default::default() })?;
    let stale = (*buffer, *view);
    drop((buffer, other, sampler, view));
    let mut cmd = ctx.acquire_command_buffer()?;
    expect_stale(cmd.fill_buffer(stale.0, 0, 4, 0), tally);
    drop(cmd);
    expect_stale(ctx.upload_buffer(stale.0, 0, &bytes), tally);
    expect_stale(ctx.raw_image(stale.1), tally);
    tally.count("buffers, samplers and views created and destroyed");
    Ok(())
}

fn expect_stale<T>(result: Result<T>, tally: &mut Tally) {
    match result.map(drop) {
        Err(Error::StaleHandle { .. }) => tally.count("stale handles refused"),
        other => unreachable!("a stale handle: {other:?}"),
    }
}
