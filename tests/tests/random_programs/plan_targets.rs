//! Plans of passes with a depth target, of passes with several samples a pixel, and of samples of textures.

use lvk::{
    AddressMode, CompareOp, Context, Dependencies, DepthAttachment, DepthBias, DepthState, Format, Holder,
    Queue, RenderPassDesc, Resolve, TextureDesc, TextureHandle, TextureRegion, TextureUsage,
};

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

impl World<'_> {
    /// Plans a pass with a depth target of its own, which is cleared, and destroyed before the pass runs. The draws
    /// replace the depth test of the pipeline, and fill the rectangle by its scissor or by its viewport.
    pub(super) fn draw_depth(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let mistake = n[5].is_multiple_of(8).then_some(n[5] / 8 % 6);
        let mut pass = self.pass([n[0], n[1], n[2]], None)?;
        pass.problems.extend(graphics_problems(queue, []));
        pass.problems
            .extend(mistake.map(|mistake| if mistake == 0 { Problem::Stale } else { Problem::Usage }));
        let cleared = u32::from(n[3] % 4) * 16;
        let draws: Vec<DeepDraw> = (0..n[3] / 4 % 4).map(|at| DeepDraw::new(n[4] >> (3 * at))).collect();
        let last = last_passing(&draws, cleared);
        let seed = |at: usize| n[4] % 1000 + at as u16;
        let effects = match last {
            Some(at) if pass.problems.is_empty() => pass.fill(seed(at)).into_iter().collect(),
            _ => Vec::new(),
        };
        let extent = pass.whole.map_or([1, 1], |whole| whole.extent);
        let words: Vec<u32> = (0..draws.len()).map(|at| pass.word(seed(at))).collect();
        let by_viewport = n[5] & 1 == 1;
        let format = self.env.kit.draw_kit.depth_format();
        let pipeline = self.env.kit.draw_kit.depth(pass.format)?;
        Some(Planned::new(pass.problems, effects, move |env, cmd| {
            let [width, height] = extent;
            let extent = if mistake == Some(1) { [width + 1, height] } else { extent };
            let depth = own_target(env.ctx(), format, extent, 1)?;
            let mut attachment = DepthAttachment::clear(*depth, cleared as f32 / 64.0);
            attachment.read_only = mistake == Some(2);
            if mistake == Some(0) {
                drop(depth);
            }
            let desc =
                RenderPassDesc { color: &[pass.target], depth: Some(attachment), ..Default::default() };
            let mut drawn = cmd.begin_rendering(&desc)?;
            drawn.bind_render_pipeline(pipeline)?;
            match mistake {
                Some(3) => drawn.viewport([0.0, 0.0, 0.0, 1.0], [0.0, 1.0])?,
                Some(4) => drawn.read_targets()?,
                Some(_) => drawn.depth_bias(DepthBias::default())?,
                None => {}
            }
            let [x, y] = pass.offset;
            let [width, height] = pass.extent;
            match by_viewport {
                true => drawn.viewport([x, y, width, height].map(|at| at as f32), [0.0, 1.0])?,
                false => drawn.scissor(pass.offset, pass.extent)?,
            }
            // State that these pipelines do not use.
            drawn.blend_constants([0.5; 4]);
            drawn.stencil_reference(3, 3)?;
            for (at, (draw, word)) in (0..).zip(draws.iter().zip(&words)) {
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
        }))
    }

    /// Plans a pass with several samples a pixel, in a target of its own, which is cleared, drawn to and resolved: at
    /// the end of the pass, or by a command that takes the rectangle.
    pub(super) fn draw_samples(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let in_pass = n[5] & 1 == 1;
        let mistake = n[5].is_multiple_of(7).then_some(n[5] / 7 % 2);
        let mut pass = self.pass([n[0], n[1], n[2]], None)?;
        if !in_pass && (pass.problems.contains(&Problem::Usage) || self.is_volume(&self.pick_texture(n[0])?))
        {
            // A resolve by a command needs no target, and counts slices in another way.
            return None;
        }
        pass.problems.extend(graphics_problems(queue, []));
        pass.problems.extend(mistake.map(|_| Problem::Usage));
        let (whole, place, format) = (pass.whole, pass.place, pass.format);
        let fill = |place, seed| Effect::Fill { place, texel: texel(format, seed).0 };
        let effects = match (whole, place) {
            (Some(whole), Some(place)) if pass.problems.is_empty() => match in_pass {
                true => vec![fill(whole, n[3]), fill(place, n[4])],
                false => vec![fill(place, n[4])],
            },
            _ => Vec::new(),
        };
        let extent = whole.map_or([1, 1], |whole| whole.extent);
        let word = pass.word(n[4]);
        let pipeline = self.env.kit.draw_kit.samples(format)?;
        let clear = load_op(format, Some(n[3]));
        Some(Planned::new(pass.problems.clone(), effects, move |env, cmd| {
            let [width, height] = extent;
            // A larger target cannot be resolved in the pass; one of a sample cannot be resolved at all.
            let (extent, samples) = match mistake {
                Some(0) if in_pass => ([width, height + 1], SAMPLES),
                Some(_) => (extent, 1),
                None => (extent, SAMPLES),
            };
            let many = own_target(env.ctx(), format, extent, samples)?;
            let Pass { target, offset, extent, .. } = pass;
            let to = Resolve { texture: target.texture, mip: target.mip, layer: target.layer };
            let resolve = in_pass.then_some(to);
            let color =
                lvk::ColorAttachment { texture: *many, mip: 0, layer: 0, load: clear, resolve, ..target };
            let mut drawn = cmd.begin_rendering(&RenderPassDesc { color: &[color], ..Default::default() })?;
            if samples == SAMPLES {
                drawn.bind_render_pipeline(pipeline)?;
                let from = drawn.upload_slice(&[word])?;
                drawn.push_constants(&Push { index: 32, from, number: 1, ..Default::default() })?;
                let [x, y, width, height] = [offset[0], offset[1], extent[0], extent[1]].map(|at| at as f32);
                // Lavapipe 25.0 covers samples of the pixels beside a scissor.
                drawn.viewport([x, y, width, height], [0.0, 1.0])?;
                drawn.draw(0..3, 0..1)?;
            }
            drop(drawn);
            if in_pass {
                return Ok(());
            }
            let from = TextureRegion { offset, extent, ..Default::default() };
            let to = TextureRegion { mip: target.mip, layer: target.layer, ..from };
            cmd.resolve_texture(*many, &from, target.texture, &to)
        }))
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
