//! Plans of recorded commands: the call, the problems that it must report, and the effects that it has.

use lvk::{Aspect, BufferCopy, CommandBuffer, Dependencies, Queue, TextureRegion};

use super::cell::pattern;
use super::environment::Environment;
use super::image::mip_extent;
use super::kit::{Kernel, Push};
use super::memory::{Effect, pattern_word};
use super::op::{Kind, Op};
use super::world::{Problem, World, judge};

/// The call of a command.
pub type Action = Box<dyn FnOnce(&Environment, &mut CommandBuffer) -> lvk::Result<()> + Send>;

/// A command before it is recorded.
pub struct Planned {
    pub kind: Kind,
    pub action: Action,
    pub problems: Vec<Problem>,
    pub effects: Vec<Effect>,
    /// Version of an object that the command uses and any thread may destroy.
    pub replaced: Option<u64>,
}

impl Planned {
    /// Returns a command that must succeed if there are no problems.
    pub fn new(
        problems: Vec<Problem>,
        effects: Vec<Effect>,
        action: impl FnOnce(&Environment, &mut CommandBuffer) -> lvk::Result<()> + Send + 'static,
    ) -> Self {
        Self { kind: Kind::Label, action: Box::new(action), problems, effects, replaced: None }
    }

    /// Records the command. Returns the effects of one that succeeds, and `None` if it is refused as it must be. An object
    /// that is gone before the call must be refused, one that is there behind the call must not.
    pub fn run(mut self, env: &Environment, cmd: &mut CommandBuffer) -> Result<Option<Vec<Effect>>, String> {
        let is_gone = || self.replaced.is_some_and(|version| !env.shared.is_current(version));
        let was_gone = is_gone();
        let outcome = (self.action)(env, cmd);
        if was_gone || (outcome.is_err() && is_gone()) {
            self.problems.push(Problem::Stale);
        }
        Ok(judge(outcome, &self.problems)?.map(|()| self.effects))
    }
}

/// Returns a range in `size` bytes, or in one of 24 cases one that does not lie inside.
pub fn range(offset: u16, length: u16, size: usize) -> (u64, u64, bool) {
    let (start, count) = (usize::from(offset) % (size + 1), usize::from(length));
    match offset % 24 {
        22 => (start as u64, (size - start) as u64 + 1 + u64::from(length % 9), false),
        23 => (u64::MAX - u64::from(length % 9), 16, false),
        _ => (start as u64, (count % (size - start + 1)) as u64, true),
    }
}

/// Returns a region of a texture, mostly one that exists.
pub fn region(info: &super::image::Part, n: [u16; 2]) -> TextureRegion {
    let [a, b] = n.map(u32::from);
    let mip = a % info.mips;
    let whole = mip_extent(info.extent, info.base_mip + mip);
    let layer = (a >> 2) % info.layers;
    let mut region = TextureRegion { mip, layer, aspect: Aspect::Main, ..Default::default() };
    if b & 1 == 1 {
        let offset = [(b >> 1) % whole[0], (b >> 4) % whole[1]];
        let extent = [1 + (b >> 7) % (whole[0] - offset[0]), 1 + (b >> 10) % (whole[1] - offset[1])];
        (region.offset, region.extent) = (offset, extent);
    }
    if b & 6 == 6 {
        region.layers = 0;
    }
    match a % 37 {
        33 => region.mip = info.mips,
        34 => region.layer = info.layers,
        35 => region.extent = [whole[0] + 1, whole[1]],
        36 => region.extent = [0, 1],
        _ => {}
    }
    region
}

impl World<'_> {
    /// Plans a command for the open command buffer `at`. `None` if there are no objects for it.
    pub fn plan(&mut self, op: &Op, at: usize) -> Option<Planned> {
        let planned = self.plan_kind(op, at)?;
        let expected = |effect| self.env.expected(op.kind, effect);
        let effects = planned.effects.into_iter().map(expected).collect();
        Some(Planned { kind: op.kind, effects, ..planned })
    }

    fn plan_kind(&mut self, op: &Op, at: usize) -> Option<Planned> {
        let n = op.n;
        let queue = self.open[at].queue;
        match op.kind {
            Kind::CopyBuffer => self.copy_buffer(n),
            Kind::CopyRegions => self.copy_regions(n),
            Kind::FillBuffer => self.fill_buffer(n),
            Kind::UpdateBuffer => self.update_buffer(n),
            Kind::UpdateTexture => self.update_texture(n),
            Kind::BufferToTexture => self.buffer_to_texture(n),
            Kind::TextureToBuffer => self.texture_to_buffer(n),
            Kind::CopyTexture => self.copy_texture(n),
            Kind::ClearTexture => self.clear_texture(n, queue),
            Kind::Blit => self.blit(n, queue),
            Kind::Mipmaps => self.mipmaps(n, queue),
            Kind::DispatchFill => self.dispatch_fill(n, queue),
            Kind::DispatchIndirect => self.dispatch_indirect(n, queue),
            Kind::DispatchCopy => self.dispatch_copy(n, queue),
            Kind::ReadUploaded => self.read_uploaded(n, queue),
            Kind::StoreImage => self.store_image(n, queue),
            Kind::FetchTexture => self.fetch_texture(n, queue),
            Kind::Draw => self.draw(n, queue),
            Kind::Timestamp => self.timestamp(n, at),
            Kind::MoveTriangle => self.move_triangle(n),
            Kind::BuildBlas => self.build_blas(n, at),
            Kind::UpdateTlas => self.update_tlas(n, at),
            Kind::Trace => self.trace(n, queue),
            Kind::TraceRays => self.trace_rays(n, queue),
            Kind::DrawIndexed => self.draw_indexed(n, queue),
            Kind::DrawIndirect => self.draw_indirect(n, queue),
            Kind::DrawCounted => self.draw_counted(n, queue),
            Kind::DrawMesh => self.draw_mesh(n, queue),
            Kind::DrawDepth => self.draw_depth(n, queue),
            Kind::DrawSamples => self.draw_samples(n, queue),
            Kind::SampleTexture => self.sample_texture(n, queue),
            Kind::WriteTime => self.write_time(n, at),
            Kind::CountSamples => self.count_samples(n, at),
            Kind::UpdateTlasFromBuffer => self.update_tlas_from_buffer(n, at),
            Kind::WrongStructure => self.wrong_structure(n, queue),
            Kind::FillShared => self.fill_shared(n),
            Kind::CopyToShared => self.copy_shared(n, false),
            Kind::CopyFromShared => self.copy_shared(n, true),
            Kind::DispatchToShared => self.dispatch_to_shared(n, queue),
            Kind::DispatchFromShared => self.dispatch_from_shared(n, queue),
            Kind::TexelsToShared => self.copy_shared_texels(n, false),
            Kind::TexelsFromShared => self.copy_shared_texels(n, true),
            Kind::StoreShared => self.store_shared(n, queue),
            Kind::FetchShared => self.fetch_shared(n, queue),
            Kind::BuildShared => self.build_shared(at),
            Kind::TraceShared => self.trace_shared(n, queue),
            Kind::UseReplaced => self.use_replaced(n, queue),
            _ => Some(Planned::new(Vec::new(), Vec::new(), move |_, cmd| {
                match n[0] % 3 {
                    0 => cmd.push_label("part"),
                    1 => cmd.pop_label(),
                    _ => cmd.insert_label("here"),
                }
                Ok(())
            })),
        }
    }

    fn size(&self, buffer: Option<usize>) -> usize {
        buffer.map_or(16, |number| self.buffers[number].info.size)
    }

    fn copy_buffer(&self, n: [u16; 6]) -> Option<Planned> {
        let (from, to) = (self.pick_buffer(n[0])?, self.pick_buffer(n[1])?);
        let mut problems: Vec<_> = [from.problem, to.problem].into_iter().flatten().collect();
        let (start, length, inside) = range(n[2], n[3], self.size(from.live));
        let room = self.size(to.live);
        let target = if n[4] % 24 == 23 { room as u64 } else { u64::from(n[4]) % (room as u64 + 1) };
        let length =
            if inside && n[4] % 24 < 22 { length.min(room as u64 - target.min(room as u64)) } else { length };
        let fits = inside && target.saturating_add(length) <= room as u64;
        let overlaps = from.live == to.live
            && start < target.saturating_add(length)
            && target < start.saturating_add(length);
        if !fits || (overlaps && length > 0) {
            problems.push(Problem::Usage);
        }
        let effects = match (from.live, to.live) {
            (Some(source), Some(sink)) if problems.is_empty() => {
                let size = length as usize;
                vec![Effect::CopyBytes { from: (source, start as usize), to: (sink, target as usize), size }]
            }
            _ => Vec::new(),
        };
        let (from, to) = (from.handle, to.handle);
        Some(Planned::new(problems, effects, move |_, cmd| cmd.copy_buffer(from, start, to, target, length)))
    }

    /// Copies two ranges of the lower half of a buffer to the upper half of another, which may be the same.
    fn copy_regions(&self, n: [u16; 6]) -> Option<Planned> {
        let (from, to) = (self.pick_buffer(n[0])?, self.pick_buffer(n[1])?);
        let mut problems: Vec<_> = [from.problem, to.problem].into_iter().flatten().collect();
        let quarter = (self.size(from.live).min(self.size(to.live)) / 4) as u64;
        let upper = self.size(to.live) as u64 - 2 * quarter;
        let first = u64::from(n[2]) % (quarter + 1);
        let mut regions = [
            BufferCopy { source_offset: 0, target_offset: upper, size: first },
            BufferCopy { source_offset: quarter, target_offset: upper + quarter, size: quarter },
        ];
        if n[3] % 12 == 11 && first > 0 && quarter > 0 {
            regions[1].target_offset = upper;
            problems.push(Problem::Usage);
        }
        let effects = match (from.live, to.live) {
            (Some(source), Some(sink)) if problems.is_empty() => {
                let effect = |region: &BufferCopy| Effect::CopyBytes {
                    from: (source, region.source_offset as usize),
                    to: (sink, region.target_offset as usize),
                    size: region.size as usize,
                };
                regions.iter().map(effect).collect()
            }
            _ => Vec::new(),
        };
        let (from, to) = (from.handle, to.handle);
        Some(Planned::new(problems, effects, move |_, cmd| cmd.copy_buffer_regions(from, to, &regions)))
    }

    fn fill_buffer(&self, n: [u16; 6]) -> Option<Planned> {
        let buffer = self.pick_buffer(n[0])?;
        let mut problems: Vec<_> = buffer.problem.into_iter().collect();
        let (mut offset, mut size, inside) = range(n[1], n[2], self.size(buffer.live));
        if n[3] % 16 != 15 {
            (offset, size) = (offset & !3, size & !3);
        }
        let fits = offset.checked_add(size).is_some_and(|end| end <= self.size(buffer.live) as u64);
        if !fits || offset % 4 != 0 || size % 4 != 0 {
            problems.push(Problem::Usage);
        }
        debug_assert!(!inside || fits);
        let word = pattern_word(n[4], 0);
        let effects = match buffer.live {
            Some(number) if problems.is_empty() => {
                let bytes = word.repeat(size as usize / 4);
                vec![Effect::Bytes { buffer: number, offset: offset as usize, bytes }]
            }
            _ => Vec::new(),
        };
        let (handle, value) = (buffer.handle, u32::from_le_bytes(word));
        Some(Planned::new(problems, effects, move |_, cmd| cmd.fill_buffer(handle, offset, size, value)))
    }

    fn update_buffer(&self, n: [u16; 6]) -> Option<Planned> {
        let buffer = self.pick_buffer(n[0])?;
        let mut problems: Vec<_> = buffer.problem.into_iter().collect();
        let (offset, size, inside) = range(n[1], n[2], self.size(buffer.live));
        if !inside {
            problems.push(Problem::Usage);
        }
        let bytes = pattern(n[3], size as usize);
        let effects = match buffer.live {
            Some(number) if problems.is_empty() => {
                vec![Effect::Bytes { buffer: number, offset: offset as usize, bytes: bytes.clone() }]
            }
            _ => Vec::new(),
        };
        let handle = buffer.handle;
        Some(Planned::new(problems, effects, move |_, cmd| cmd.update_buffer(handle, offset, &bytes)))
    }

    /// Returns words of a buffer: its handle, problems, number, first byte and count.
    pub(super) fn words(&self, pick: u16, start: u16, count: u16, most: usize) -> Option<Words> {
        let buffer = self.pick_buffer(pick)?;
        let words = self.size(buffer.live) / 4;
        let first = usize::from(start) % (words + 1);
        let count = (usize::from(count) % (words - first + 1)).min(most);
        Some(Words {
            handle: buffer.handle,
            number: buffer.live,
            problem: buffer.problem,
            offset: first * 4,
            count,
        })
    }

    /// Returns exactly `count` words of a buffer. `None` if it is smaller.
    pub(super) fn exact_words(&self, pick: u16, start: u16, count: usize) -> Option<Words> {
        let buffer = self.pick_buffer(pick)?;
        let size = if buffer.live.is_some() { self.size(buffer.live) } else { 4 * count };
        let room = (size / 4).checked_sub(count)?;
        let offset = 4 * (usize::from(start) % (room + 1));
        Some(Words { handle: buffer.handle, number: buffer.live, problem: buffer.problem, offset, count })
    }

    fn dispatch_fill(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let to = self.words(n[0], n[1], n[2], 64)?;
        let problems = compute_problems(queue, [to.problem]);
        let effects = to.pattern_effect(&problems, n[3]);
        let seed = u32::from(n[3]);
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Fill))?;
            cmd.push_constants(&Push { to: address, number: seed, ..Default::default() })?;
            cmd.dispatch(
                [to.count as u32, 1, 1],
                &Dependencies { buffers: &[to.handle], ..Default::default() },
            )
        }))
    }

    fn dispatch_indirect(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let to = self.words(n[0], n[1], n[2], 64)?;
        let mut problems = compute_problems(queue, [to.problem]);
        let arguments = match n[4] % 12 {
            0 => self.pick_buffer(n[5])?.handle,
            _ => *self.arguments,
        };
        let offset = match n[4] % 12 {
            1 => 2,
            2 => 8,
            _ => 0,
        };
        if n[4].is_multiple_of(12) {
            let buffer = self.pick_buffer(n[5])?;
            problems.extend(buffer.problem);
            if buffer.problem.is_none() {
                problems.push(Problem::Usage);
            }
        } else if offset != 0 {
            problems.push(Problem::Usage);
        }
        let effects = to.pattern_effect(&problems, n[3]);
        let (seed, own) = (u32::from(n[3]), *self.arguments);
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            let counts = [to.count as u32, 1, 1];
            cmd.update_buffer(own, 0, bytemuck::cast_slice(&counts))?;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Fill))?;
            cmd.push_constants(&Push { to: address, number: seed, ..Default::default() })?;
            let writes = Dependencies { buffers: &[to.handle], ..Default::default() };
            cmd.dispatch_indirect(arguments, offset, &writes)
        }))
    }

    fn dispatch_copy(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (from, mut to) = (self.words(n[0], n[1], n[2], 64)?, self.words(n[3], n[4], n[5], 64)?);
        if from.number.is_some() && from.number == to.number {
            return None;
        }
        to.count = to.count.min(from.count);
        let problems = compute_problems(queue, [from.problem, to.problem]);
        let effects = match (from.number, to.number) {
            (Some(source), Some(sink)) if problems.is_empty() => {
                vec![Effect::CopyBytes {
                    from: (source, from.offset),
                    to: (sink, to.offset),
                    size: 4 * to.count,
                }]
            }
            _ => Vec::new(),
        };
        Some(Planned::new(problems, effects, move |env, cmd| {
            let push = Push {
                from: env.ctx().buffer_address(from.handle)? + from.offset as u64,
                to: env.ctx().buffer_address(to.handle)? + to.offset as u64,
                ..Default::default()
            };
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Copy))?;
            cmd.push_constants(&push)?;
            let uses =
                Dependencies { buffers: &[to.handle], read_buffers: &[from.handle], ..Default::default() };
            cmd.dispatch([to.count as u32, 1, 1], &uses)
        }))
    }

    fn read_uploaded(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let to = self.words(n[0], n[1], n[2], 64)?;
        let problems = compute_problems(queue, [to.problem]);
        let bytes = pattern(n[3], 4 * to.count);
        let effects = match to.number {
            Some(number) if problems.is_empty() => {
                vec![Effect::Bytes { buffer: number, offset: to.offset, bytes: bytes.clone() }]
            }
            _ => Vec::new(),
        };
        Some(Planned::new(problems, effects, move |env, cmd| {
            let target = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            let from = cmd.upload_slice(&bytes)?;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Copy))?;
            cmd.push_constants(&Push { to: target, from, ..Default::default() })?;
            cmd.dispatch(
                [to.count as u32, 1, 1],
                &Dependencies { buffers: &[to.handle], ..Default::default() },
            )
        }))
    }
}

/// Words of a buffer.
#[derive(Debug, Clone, Copy)]
pub struct Words {
    /// Handle of the buffer.
    pub handle: lvk::BufferHandle,
    /// Number of the buffer, if it is alive.
    pub number: Option<usize>,
    /// Reason why calls refuse it.
    pub problem: Option<Problem>,
    /// First byte.
    pub offset: usize,
    /// Number of words.
    pub count: usize,
}

impl Words {
    fn pattern_effect(&self, problems: &[Problem], seed: u16) -> Vec<Effect> {
        match self.number {
            Some(buffer) if problems.is_empty() => {
                let bytes = (0..self.count).flat_map(|index| pattern_word(seed, index)).collect();
                vec![Effect::Bytes { buffer, offset: self.offset, bytes }]
            }
            _ => Vec::new(),
        }
    }
}

/// Returns the problems of a command that needs a compute queue.
pub fn compute_problems<const N: usize>(queue: Queue, others: [Option<Problem>; N]) -> Vec<Problem> {
    let wrong = (queue == Queue::Transfer).then_some(Problem::WrongQueue);
    others.into_iter().flatten().chain(wrong).collect()
}

/// Returns the problems of a command that needs the graphics queue.
pub fn graphics_problems<const N: usize>(queue: Queue, others: [Option<Problem>; N]) -> Vec<Problem> {
    let wrong = (queue != Queue::Graphics).then_some(Problem::WrongQueue);
    others.into_iter().flatten().chain(wrong).collect()
}
