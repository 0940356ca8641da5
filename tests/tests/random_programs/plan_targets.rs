//! Plans of passes with a depth target, of passes with several samples a pixel, and of samples of textures.

use lvk::{
    AddressMode, ColorAttachment, ColorLoadOp, CommandBuffer, CompareOp, Context, Dependencies,
    DepthAttachment, DepthBias, DepthState, Format, Holder, Queue, RenderPass, RenderPassDesc,
    RenderPipelineHandle, Resolve, TextureDesc, TextureHandle, TextureRegion, TextureUsage,
};

use super::environment::Environment;
use super::image::texel_bytes;
use super::kit::{Kernel, Push};
use super::kit_draws::SAMPLES;
use super::memory::Effect;
use super::plan::{Planned, compute_problems, graphics_problems};
use super::plan_draws::Pass;
use super::plan_textures::{load_op, texel};
use super::world::{Problem, World};

/// Comparisons of depth that programs use.
const COMPARES: [CompareOp; 5] =
    [CompareOp::Less, CompareOp::GreaterOrEqual, CompareOp::Equal, CompareOp::Always, CompareOp::Never];

/// A draw to a depth target: its depth in 64ths, its comparison, and whether it writes.
#[derive(Debug, Clone, Copy)]
struct DeepDraw {
    depth: u32,
    compare: CompareOp,
    write: bool,
}

impl DeepDraw {
    fn new(bits: u16) -> Self {
        let compare = COMPARES[usize::from(bits >> 4) % COMPARES.len()];
        Self { depth: u32::from(bits % 4) * 16, compare, write: bits & 8 == 0 }
    }

    /// True if the draw passes over pixels of a depth.
    fn passes(&self, other: u32) -> bool {
        match self.compare {
            CompareOp::Less => self.depth < other,
            CompareOp::GreaterOrEqual => self.depth >= other,
            CompareOp::Equal => self.depth == other,
            CompareOp::Always => true,
            _ => false,
        }
    }
}

/// Returns the number of the last draw that passes, if one does, over pixels of a depth.
fn last_passing(draws: &[DeepDraw], mut depth: u32) -> Option<usize> {
    let mut last = None;
    for (at, draw) in draws.iter().enumerate().filter(|(_, draw)| draw.compare != CompareOp::Never) {
        if draw.passes(depth) {
            last = Some(at);
            depth = if draw.write { draw.depth } else { depth };
        }
    }
    last
}

/// Creates a target for one command buffer.
fn own_target(
    ctx: &Context,
    format: Format,
    extent: [u32; 2],
    samples: u32,
) -> lvk::Result<Holder<TextureHandle>> {
    let usage = TextureUsage::TARGET;
    ctx.create_texture(&TextureDesc {
        format,
        extent,
        samples,
        usage,
        debug_name: "own target",
        ..Default::default()
    })
}

/// A pass with a depth target of its own.
struct DepthPass {
    pass: Pass,
    mistake: Option<u16>,
    /// Depth to which the target is cleared, in 64ths.
    cleared: u32,
    /// Draws, each with the word that it paints.
    draws: Vec<(DeepDraw, u32)>,
    by_viewport: bool,
    format: Format,
    pipeline: RenderPipelineHandle,
}

impl DepthPass {
    fn record(&self, env: &Environment, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let [width, height] = self.pass.mip_extent();
        let extent = [width + u32::from(self.mistake == Some(1)), height];
        let depth = own_target(env.ctx(), self.format, extent, 1)?;
        let mut attachment = DepthAttachment::clear(*depth, self.cleared as f32 / 64.0);
        attachment.read_only = self.mistake == Some(2);
        if self.mistake == Some(0) {
            drop(depth);
        }
        let color = [self.pass.target];
        let desc = RenderPassDesc { color: &color, depth: Some(attachment), ..Default::default() };
        let mut drawn = cmd.begin_rendering(&desc)?;
        drawn.bind_render_pipeline(self.pipeline)?;
        match self.mistake {
            Some(3) => drawn.viewport([0.0, 0.0, 0.0, 1.0], [0.0, 1.0])?,
            Some(4) => drawn.read_targets()?,
            Some(_) => drawn.depth_bias(DepthBias::default())?,
            None => {}
        }
        match self.by_viewport {
            true => drawn.viewport(self.pass.rectangle(), [0.0, 1.0])?,
            false => drawn.scissor(self.pass.offset, self.pass.extent)?,
        }
        self.draw(&mut drawn)
    }

    /// Draws, every other time with the word in memory.
    fn draw(&self, drawn: &mut RenderPass<'_>) -> lvk::Result<()> {
        // State that the pipelines do not use.
        drawn.blend_constants([0.5; 4]);
        drawn.stencil_reference(3, 3)?;
        for (at, (draw, word)) in self.draws.iter().enumerate() {
            drawn.depth_state(DepthState { compare: draw.compare, write: draw.write })?;
            let push = Push { index: draw.depth, ..Default::default() };
            let push = match at % 2 {
                0 => Push { word: *word, ..push },
                _ => Push { from: drawn.upload(word)?, number: 1, ..push },
            };
            drawn.push_constants(&push)?;
            drawn.draw(0..3, 0..1)?;
        }
        Ok(())
    }
}

/// A pass with several samples a pixel, in a target of its own.
struct SamplesPass {
    pass: Pass,
    mistake: Option<u16>,
    /// True if the end of the pass resolves, false if a command does.
    in_pass: bool,
    clear: ColorLoadOp,
    word: u32,
    pipeline: RenderPipelineHandle,
}

impl SamplesPass {
    fn record(&self, env: &Environment, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let [width, height] = self.pass.mip_extent();
        // A larger target cannot be resolved in the pass; one of a sample cannot be resolved at all.
        let (own_extent, samples) = match self.mistake {
            Some(0) if self.in_pass => ([width, height + 1], SAMPLES),
            Some(_) => ([width, height], 1),
            None => ([width, height], SAMPLES),
        };
        let many = own_target(env.ctx(), self.pass.format, own_extent, samples)?;
        let ColorAttachment { texture, mip, layer, .. } = self.pass.target;
        let color = ColorAttachment {
            texture: *many,
            mip: 0,
            layer: 0,
            load: self.clear,
            store: true,
            resolve: self.in_pass.then_some(Resolve { texture, mip, layer }),
        };
        let mut drawn = cmd.begin_rendering(&RenderPassDesc { color: &[color], ..Default::default() })?;
        if samples == SAMPLES {
            drawn.bind_render_pipeline(self.pipeline)?;
            let from = drawn.upload_slice(&[self.word])?;
            drawn.push_constants(&Push { index: 32, from, number: 1, ..Default::default() })?;
            // Lavapipe 25.0 covers samples of the pixels beside a scissor.
            drawn.viewport(self.pass.rectangle(), [0.0, 1.0])?;
            drawn.draw(0..3, 0..1)?;
        }
        drop(drawn);
        if self.in_pass {
            return Ok(());
        }
        let from = TextureRegion { offset: self.pass.offset, extent: self.pass.extent, ..Default::default() };
        cmd.resolve_texture(*many, &from, texture, &TextureRegion { mip, layer, ..from })
    }
}

impl World<'_> {
    /// Plans a pass with a depth target of its own, which is cleared, and destroyed before the pass runs. The draws
    /// replace the depth test of the pipeline, and fill the rectangle by its scissor or by its viewport.
    pub(super) fn draw_depth(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let mistake = n[5].is_multiple_of(8).then_some(n[5] / 8 % 6);
        let mut pass = self.pass([n[0], n[1], n[2]], None)?;
        pass.problems.extend(graphics_problems(queue, []));
        let problem = |mistake| if mistake == 0 { Problem::Stale } else { Problem::Usage };
        pass.problems.extend(mistake.map(problem));
        let cleared = u32::from(n[3] % 4) * 16;
        let draws: Vec<DeepDraw> = (0..n[3] / 4 % 4).map(|at| DeepDraw::new(n[4] >> (3 * at))).collect();
        let seed = |at: usize| n[4] % 1000 + at as u16;
        let effects = match last_passing(&draws, cleared) {
            Some(at) if pass.problems.is_empty() => pass.fill(seed(at)).into_iter().collect(),
            _ => Vec::new(),
        };
        let words = (0..draws.len()).map(|at| pass.word(seed(at)));
        let depth = DepthPass {
            draws: draws.iter().copied().zip(words).collect(),
            mistake,
            cleared,
            by_viewport: n[5] & 1 == 1,
            format: self.env.kit.draw_kit.depth_format(),
            pipeline: self.env.kit.draw_kit.depth(pass.format)?,
            pass,
        };
        Some(Planned::new(depth.pass.problems.clone(), effects, move |env, cmd| depth.record(env, cmd)))
    }

    /// Plans a pass with several samples a pixel, in a target of its own, which is cleared, drawn to and resolved: at
    /// the end of the pass, or by a command that takes the rectangle.
    pub(super) fn draw_samples(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let in_pass = n[5] & 1 == 1;
        let mistake = n[5].is_multiple_of(7).then_some(n[5] / 7 % 2);
        let mut pass = self.pass([n[0], n[1], n[2]], None)?;
        let is_volume = self.is_volume(&self.pick_texture(n[0])?);
        if !in_pass && (is_volume || pass.problems.contains(&Problem::Usage)) {
            // A resolve by a command needs no target, and counts slices in another way.
            return None;
        }
        pass.problems.extend(graphics_problems(queue, []));
        let lacks_volumes = is_volume && !self.ctx().capabilities().resolves_to_volumes;
        pass.problems.extend(lacks_volumes.then_some(Problem::Unsupported));
        pass.problems.extend(mistake.map(|_| Problem::Usage));
        let mut effects = Vec::new();
        if pass.problems.is_empty() {
            let texel = texel(pass.format, n[3]).0;
            effects.extend(pass.whole.filter(|_| in_pass).map(|place| Effect::Fill { place, texel }));
            effects.extend(pass.fill(n[4]));
        }
        let samples = SamplesPass {
            mistake,
            in_pass,
            clear: load_op(pass.format, Some(n[3])),
            word: pass.word(n[4]),
            pipeline: self.env.kit.draw_kit.samples(pass.format)?,
            pass,
        };
        Some(Planned::new(samples.pass.problems.clone(), effects, move |env, cmd| samples.record(env, cmd)))
    }

    /// Plans a dispatch that samples each texel of a mip with a sampler that takes the nearest texel. The coordinates
    /// are those of the texels, or lie a whole texture away, where the address mode decides.
    pub(super) fn sample_texture(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (texture, lack) = self.flat_texture(n[0], TextureUsage::SAMPLED)?;
        let nearest = || self.samplers.iter().filter_map(|sampler| Some((sampler.index, sampler.info?)));
        let (sampler, mode) = nearest().nth(usize::from(n[4]) % nearest().count().max(1))?;
        let info = self.info(&texture);
        let mip = info.map_or(0, |info| u32::from(n[1]) % info.part.mips);
        let place = info.map(|info| info.part.whole(mip));
        let [width, height] = place.map_or([1, 1], |place| place.extent);
        let to = self.exact_words(n[2], n[3], (width * height) as usize)?;
        if info.is_some_and(|info| texel_bytes(info.format) != 4) {
            return None;
        }
        let problems = compute_problems(queue, [texture.problem, lack, to.problem]);
        let kernel = match info.map(|info| info.format) {
            Some(Format::R32Float) => Kernel::SampleFloat,
            Some(Format::Rgba8Unorm) => Kernel::SampleBytes,
            _ => Kernel::SampleUint,
        };
        let away = n[5] % 3;
        let index = texture.live.map_or(0, |number| self.textures[number].index);
        let effects = match (place, to.number) {
            (Some(place), Some(number)) if problems.is_empty() => {
                let [columns, rows] = place.extent.map(|side| sampled(side, mode, away));
                let texel =
                    |y: &u32| columns.iter().map(move |x| (y * width + x) as usize).collect::<Vec<_>>();
                let texels = rows.iter().flat_map(texel).collect();
                vec![Effect::Gather { place, texels, to: (number, to.offset) }]
            }
            _ => Vec::new(),
        };
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            cmd.bind_compute_pipeline(env.kit.kernel(kernel))?;
            let word = u32::from(away);
            cmd.push_constants(&Push {
                to: address,
                index,
                number: mip,
                word,
                sampler,
                ..Default::default()
            })?;
            let uses =
                Dependencies { buffers: &[to.handle], sampled_images: &[handle], ..Default::default() };
            cmd.dispatch([width, height, 1], &uses)
        }))
    }
}

/// Returns the texels along a side that coordinates in the texture before, in it, or in the one behind it give.
fn sampled(side: u32, mode: AddressMode, away: u16) -> Vec<u32> {
    let texel = |at: u32| match (mode, away) {
        (_, 1) | (AddressMode::Repeat, _) => at,
        (AddressMode::MirroredRepeat, _) => side - 1 - at,
        (_, 0) => 0,
        _ => side - 1,
    };
    (0..side).map(texel).collect()
}

#[test]
fn the_last_draw_that_passes_is_seen() {
    let draw = |depth, compare, write| DeepDraw { depth, compare, write };
    let draws =
        [draw(16, CompareOp::Less, true), draw(32, CompareOp::Less, true), draw(16, CompareOp::Equal, false)];
    assert_eq!(last_passing(&draws, 48), Some(2));
    assert_eq!(last_passing(&draws[..2], 48), Some(0));
    assert_eq!(last_passing(&draws, 0), None);
}

#[test]
fn address_modes_repeat_mirror_and_clamp() {
    assert_eq!(sampled(3, AddressMode::Repeat, 0), [0, 1, 2]);
    assert_eq!(sampled(3, AddressMode::MirroredRepeat, 2), [2, 1, 0]);
    assert_eq!(sampled(3, AddressMode::ClampToEdge, 0), [0; 3]);
    assert_eq!(sampled(3, AddressMode::ClampToEdge, 2), [2; 3]);
    assert_eq!(sampled(3, AddressMode::ClampToEdge, 1), [0, 1, 2]);
}
