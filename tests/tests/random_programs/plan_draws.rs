//! Plans of passes that draw triangles of items: by index, with arguments and numbers from buffers, and by mesh shaders.

use lvk::{
    BufferHandle, ColorAttachment, Dependencies, Format, IndexFormat, IndirectCount, OptionalFeature, Queue,
    RenderPass, RenderPassDesc, TextureUsage,
};
use lvk_tests::random::Random;

use super::draw_items::{ARGUMENTS, Draw, DrawBuffers, INDICES, INPUT_BYTES, Inputs, MOST_DRAWS, Triangles};
use super::environment::Environment;
use super::image::Place;
use super::kit::Push;
use super::kit_draws::{COLUMNS, FrontEnd};
use super::memory::Effect;
use super::plan::{Planned, graphics_problems};
use super::plan_textures::{load_op, texel};
use super::world::{Problem, World};

/// A pass over one mip of a layer, and the rectangle that is drawn to.
#[derive(Debug, Clone)]
pub struct Pass {
    pub target: ColorAttachment,
    pub format: Format,
    pub offset: [u32; 2],
    pub extent: [u32; 2],
    /// The rectangle, if it exists.
    pub place: Option<Place>,
    /// The whole mip of the layer, if it exists.
    pub whole: Option<Place>,
    pub problems: Vec<Problem>,
    /// Seed of the texel that clears the target before.
    clear: Option<u16>,
}

impl Pass {
    /// Returns the word that fills the rectangle with the texel of a seed.
    pub fn word(&self, seed: u16) -> u32 {
        texel(self.format, seed).1
    }

    /// Returns the effect that fills the rectangle with the texel of a seed.
    pub fn fill(&self, seed: u16) -> Option<Effect> {
        self.place.map(|place| Effect::Fill { place, texel: texel(self.format, seed).0 })
    }

    /// Returns the width and height of the mip, one texel if it does not exist.
    pub fn mip_extent(&self) -> [u32; 2] {
        self.whole.map_or([1, 1], |whole| whole.extent)
    }

    /// Returns the rectangle of a viewport.
    pub fn rectangle(&self) -> [f32; 4] {
        let ([x, y], [width, height]) = (self.offset, self.extent);
        [x, y, width, height].map(|at| at as f32)
    }

    /// Returns the effect of the clear.
    fn clear(&self) -> Option<Effect> {
        let texel = texel(self.format, self.clear?).0;
        self.whole.map(|place| Effect::Fill { place, texel })
    }

    /// Returns the effect of an item: it paints one column of the rectangle.
    fn paint(&self, seed: u16, item: u32) -> Option<Effect> {
        let place = self.place?;
        let column = item % COLUMNS;
        let columns = place.offset[0]..place.offset[0] + place.extent[0];
        let place = Place { offset: [column, place.offset[1]], extent: [1, place.extent[1]], ..place };
        let texel = texel(self.format, seed + item as u16).0;
        columns.contains(&column).then_some(Effect::Fill { place, texel })
    }
}

/// Mistakes of draws. Each is found after the pass has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mistake {
    NoVertices,
    NoIndices,
    OddVertices,
    OddIndices,
    NoSlot,
    BeyondIndices,
    Reversed,
    Unlisted,
    OtherPipeline,
    OddArguments,
    ShortStride,
    BeyondArguments,
    OddNumber,
}

impl Mistake {
    const BINDING: [Self; 7] = [
        Self::NoVertices,
        Self::OddVertices,
        Self::NoSlot,
        Self::Unlisted,
        Self::OtherPipeline,
        Self::NoIndices,
        Self::OddIndices,
    ];
    const DIRECT: [Self; 2] = [Self::BeyondIndices, Self::Reversed];
    const INDIRECT: [Self; 3] = [Self::OddArguments, Self::ShortStride, Self::BeyondArguments];

    /// Returns one of the mistakes in one of twelve cases.
    fn choose(n: u16, all: &[Self]) -> Option<Self> {
        n.is_multiple_of(12).then(|| all[usize::from(n / 12) % all.len()])
    }
}

/// A draw command by vertices: what it reads, and what it paints.
struct Command {
    triangles: Triangles,
    is_indexed: bool,
    mistake: Option<Mistake>,
    /// Arguments of indirect draws, and their distance.
    arguments: Vec<Vec<u32>>,
    stride: u32,
    number: Option<u32>,
    items: Vec<u32>,
}

impl Command {
    /// Binds pipeline, vertices and indices.
    fn bind(
        &self,
        env: &Environment,
        pass: &mut RenderPass<'_>,
        inputs: BufferHandle,
        (format, seed): (Format, u16),
    ) -> lvk::Result<()> {
        let front_end = match self.mistake {
            Some(Mistake::OtherPipeline) => FrontEnd::Mesh,
            _ => FrontEnd::Vertices,
        };
        if let Some(pipeline) = env.kit.draw_kit.items(front_end, format) {
            pass.bind_render_pipeline(pipeline)?;
            pass.push_constants(&Push { number: seed.into(), ..Default::default() })?;
        }
        let (slot, offset) = match self.mistake {
            Some(Mistake::NoSlot) => (16, 0),
            Some(Mistake::OddVertices) => (0, 2),
            _ => (0, 0),
        };
        if self.mistake != Some(Mistake::NoVertices) {
            pass.bind_vertex_buffer(slot, inputs, offset)?;
        }
        if self.is_indexed && self.mistake != Some(Mistake::NoIndices) {
            let offset = INDICES + if self.mistake == Some(Mistake::OddIndices) { 2 } else { 0 };
            pass.bind_index_buffer(inputs, offset, IndexFormat::U32)?;
        }
        Ok(())
    }

    /// True if the mistake is one for this command.
    fn is_wrong(&self) -> bool {
        match self.mistake {
            Some(Mistake::NoIndices | Mistake::OddIndices) => self.is_indexed,
            mistake => mistake.is_some(),
        }
    }

    /// Returns where the arguments begin, and the bytes from one draw's to the next, with the mistake.
    fn place(&self, draws: u32) -> (u64, u32) {
        match self.mistake {
            Some(Mistake::OddArguments) => (ARGUMENTS + 2, self.stride),
            Some(Mistake::ShortStride) => (ARGUMENTS, 12),
            Some(Mistake::BeyondArguments) => {
                (INPUT_BYTES - u64::from(draws.saturating_sub(1) * self.stride) - 8, self.stride)
            }
            _ => (ARGUMENTS, self.stride),
        }
    }
}

impl World<'_> {
    /// Plans a pass over a target, which is cleared before to the texel of a seed or loaded. `None` where a wrong
    /// rectangle would be found after the clear, which [`draw`](Self::draw) does, and for formats that are no targets.
    pub(super) fn pass(&self, n: [u16; 3], clear: Option<u16>) -> Option<Pass> {
        let texture = self.pick_texture(n[0])?;
        let (region, place, place_problems) = self.place(&texture, [n[1], n[2] | 1]);
        let info = texture.live.map(|number| &self.textures[number].info);
        let lacks = info.is_some_and(|info| !info.usage.contains(TextureUsage::TARGET));
        let has_layer = info
            .is_some_and(|info| region.mip < info.part.mips && region.layer + region.z < info.part.layers);
        if place.is_none() && has_layer || info.is_some_and(|info| info.format == Format::R8Uint) {
            return None;
        }
        let problems = place_problems.into_iter().chain(lacks.then_some(Problem::Usage)).collect();
        let format = info.map_or(Format::R32Uint, |info| info.format);
        let whole = info.zip(place).map(|(info, place)| Place {
            layer: place.layer,
            layers: 1,
            ..info.part.whole(region.mip)
        });
        let target = ColorAttachment {
            texture: texture.handle,
            mip: region.mip,
            layer: region.layer + region.z,
            load: load_op(format, clear),
            store: true,
            resolve: None,
        };
        Some(Pass {
            target,
            format,
            offset: region.offset,
            extent: place.map_or([1, 1], |place| place.extent),
            place: place.map(|place| Place { layers: 1, ..place }),
            whole,
            problems,
            clear,
        })
    }

    /// Plans the pass of draws of items. Draws that are wrong do not clear: they are refused after the pass has begun.
    pub(super) fn draw_pass(&self, n: [u16; 6], queue: Queue, wrong: Vec<Problem>) -> Option<Pass> {
        let clear = (n[3] & 1 == 1 && wrong.is_empty()).then_some(n[3]);
        let mut pass = self.pass([n[0], n[1], n[2]], clear)?;
        pass.problems.extend(graphics_problems(queue, []));
        pass.problems.extend(wrong);
        Some(pass)
    }

    /// Returns the command of a pass that paints items.
    pub(super) fn painted(
        &self,
        pass: Pass,
        seed: u16,
        items: &[u32],
        inputs: Inputs,
        draw: impl FnOnce(&Environment, &mut RenderPass<'_>, DrawBuffers) -> lvk::Result<()> + Send + 'static,
    ) -> Planned {
        let effects = match pass.problems.is_empty() {
            true => {
                let painted = items.iter().filter_map(|item| pass.paint(seed, *item));
                pass.clear().into_iter().chain(painted).collect()
            }
            false => Vec::new(),
        };
        let buffers = DrawBuffers {
            inputs: *self.draw_inputs[usize::from(inputs.by_dispatch())],
            number: *self.draw_number,
        };
        Planned::new(pass.problems.clone(), effects, move |env, cmd| {
            let read_buffers = inputs.write(env, cmd, &buffers)?;
            let dependencies = Dependencies { read_buffers, ..Default::default() };
            let desc = RenderPassDesc { color: &[pass.target], dependencies, ..Default::default() };
            let mut drawn = cmd.begin_rendering(&desc)?;
            assert_eq!(pass.whole.map(|whole| whole.extent), Some(drawn.extent()));
            drawn.push_label("items");
            drawn.insert_label("here");
            drawn.scissor(pass.offset, pass.extent)?;
            draw(env, &mut drawn, buffers)?;
            drawn.pop_label();
            Ok(())
        })
    }

    /// Plans a pass that draws by vertices.
    fn vertex_draw(
        &self,
        n: [u16; 6],
        queue: Queue,
        command: Command,
        mut others: Vec<Problem>,
        draw: impl FnOnce(&Command, &mut RenderPass<'_>, DrawBuffers) -> lvk::Result<()> + Send + 'static,
    ) -> Option<Planned> {
        let has_mesh = self.ctx().capabilities().mesh_shader;
        if command.mistake == Some(Mistake::OtherPipeline) && !has_mesh {
            return None;
        }
        others.extend(command.is_wrong().then_some(Problem::Usage));
        let pass = self.draw_pass(n, queue, others)?;
        let (format, seed) = (pass.format, n[4] % 1000);
        let arguments = (&command.arguments[..], command.stride);
        let is_unlisted = command.mistake == Some(Mistake::Unlisted);
        let inputs = Inputs::new(n[5], &command.triangles, arguments, command.number, is_unlisted);
        let items = command.items.clone();
        Some(self.painted(pass, seed, &items, inputs, move |env, pass, buffers| {
            command.bind(env, pass, buffers.inputs, (format, seed))?;
            draw(&command, pass, buffers)
        }))
    }

    pub(super) fn draw_indexed(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let random = &mut Random::new(n[3].into());
        let (triangles, draw) = (Triangles::random(random), Draw::random(random, true));
        let mistakes = [&Mistake::BINDING[..], &Mistake::DIRECT].concat();
        let command = Command {
            items: draw.items(&triangles, true),
            triangles,
            is_indexed: true,
            mistake: Mistake::choose(n[5], &mistakes),
            arguments: Vec::new(),
            stride: 0,
            number: None,
        };
        let Draw { first, count, base, first_instance, instances } = draw;
        self.vertex_draw(n, queue, command, Vec::new(), move |command, pass, _| {
            let indices = match command.mistake {
                Some(Mistake::BeyondIndices) => 0..(INPUT_BYTES - INDICES) as u32 / 4 + 1,
                Some(Mistake::Reversed) => 3 * first + 1..3 * first,
                _ => 3 * first..3 * (first + count),
            };
            pass.draw_indexed(indices, 3 * base as i32, first_instance..first_instance + instances)
        })
    }

    /// Returns a command with up to three indirect draws, of which those that the number in the buffer allows are
    /// drawn.
    fn indirect_command(&self, n: [u16; 6], random: &mut Random, number: Option<u32>) -> Command {
        let may_offset = self.ctx().capabilities().has(OptionalFeature::DrawIndirectFirstInstance);
        let triangles = Triangles::random(random);
        let is_indexed = n[3] & 2 == 2;
        let draws: Vec<Draw> =
            (0..n[3] / 4 % (MOST_DRAWS as u16 + 1)).map(|_| Draw::random(random, may_offset)).collect();
        let stride = if is_indexed { 20 } else { 16 } + 4 * u32::from(n[3] / 16 % 2);
        let executed = number.map_or(draws.len(), |number| draws.len().min(number as usize));
        let mistakes = [&Mistake::BINDING[..], &Mistake::INDIRECT].concat();
        let mut mistake = Mistake::choose(n[5], &mistakes);
        if number.is_some() && n[5] % 24 == 23 {
            mistake = Some(Mistake::OddNumber);
        }
        Command {
            items: draws[..executed].iter().flat_map(|draw| draw.items(&triangles, is_indexed)).collect(),
            triangles,
            is_indexed,
            mistake,
            arguments: draws.iter().map(|draw| draw.arguments(is_indexed)).collect(),
            stride,
            number,
        }
    }

    pub(super) fn draw_indirect(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let command = self.indirect_command(n, &mut Random::new(n[3].into()), None);
        let (mut wrong, mut arguments) = (Vec::new(), None);
        if n[5] % 24 == 23 {
            let buffer = self.pick_buffer(n[4])?;
            wrong.push(buffer.problem.unwrap_or(Problem::Usage));
            arguments = Some(buffer.handle);
        }
        self.vertex_draw(n, queue, command, wrong, move |command, pass, buffers| {
            let draws = command.arguments.len() as u32;
            let (offset, stride) = command.place(draws);
            let arguments = arguments.unwrap_or(buffers.inputs);
            match command.is_indexed {
                true => pass.draw_indexed_indirect(arguments, offset, draws, stride),
                false => pass.draw_indirect(arguments, offset, draws, stride),
            }
        })
    }

    pub(super) fn draw_counted(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let number = u32::from(n[3] / 64) % (MOST_DRAWS + 2);
        let command = self.indirect_command(n, &mut Random::new(n[3].into()), Some(number));
        let wrong = self.lack(OptionalFeature::DrawIndirectCount).into_iter().collect();
        self.vertex_draw(n, queue, command, wrong, move |command, pass, buffers| {
            let draws = counted(command.place(command.arguments.len() as u32), buffers, command);
            match command.is_indexed {
                true => pass.draw_indexed_indirect_count(&draws),
                false => pass.draw_indirect_count(&draws),
            }
        })
    }

    /// Returns the problem of a feature that the device lacks.
    fn lack(&self, feature: OptionalFeature) -> Option<Problem> {
        (!self.ctx().capabilities().has(feature)).then_some(Problem::Unsupported)
    }
}

fn counted((offset, stride): (u64, u32), buffers: DrawBuffers, command: &Command) -> IndirectCount {
    let odd = if command.mistake == Some(Mistake::OddNumber) { 2 } else { 0 };
    IndirectCount {
        arguments: buffers.inputs,
        offset,
        stride,
        count: buffers.number,
        count_offset: odd,
        max_draws: command.arguments.len() as u32,
    }
}
