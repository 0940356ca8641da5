//! Plans of commands and calls on objects that all threads use.

use lvk::{BuildMode, Dependencies, Queue, TextureRegion};

use super::calls::{MOST_PENDING, Outcome};
use super::cell::{Cell, compare, pattern};
use super::kit::{Kernel, Push};
use super::memory::{Effect, RAYS, pattern_word};
use super::op::Kind;
use super::plan::{Planned, Words, compute_problems};
use super::plan_rays::record_trace;
use super::plan_textures::texel;
use super::shared::{LAYER_BYTES, OwnPart, PART_BYTES, SIDE, answers, instance, layer_part};
use super::world::{Pending, Problem, World, judge};

/// Whole words of a part: the first byte in the part, and their bytes.
fn words_of_part(offset: u16, length: u16, most: usize) -> (usize, usize) {
    let first = usize::from(offset) % (PART_BYTES / 4);
    let count = 1 + usize::from(length) % (PART_BYTES / 4 - first).min(most / 4).max(1);
    (4 * first, 4 * count)
}

/// Returns the region of a layer of the shared texture.
fn region_of(layer: u32) -> TextureRegion {
    TextureRegion { layer, layers: 1, ..Default::default() }
}

impl World<'_> {
    fn part(&self) -> Option<&OwnPart<'_>> {
        self.part.as_ref()
    }

    /// Fills words of the own part.
    pub(super) fn fill_shared(&self, n: [u16; 6]) -> Option<Planned> {
        let part = self.part()?;
        let (offset, size) = words_of_part(n[0], n[1], PART_BYTES);
        let word = pattern_word(n[2], 0);
        let effect = Effect::Bytes { buffer: part.bytes[0], offset, bytes: word.repeat(size / 4) };
        let at = part.place(true).0 + offset as u64;
        Some(Planned::new(Vec::new(), vec![effect], move |env, cmd| {
            cmd.fill_buffer(*env.shared.buffer, at, size as u64, u32::from_le_bytes(word))
        }))
    }

    /// Copies words of an own buffer to the own part, or back from the own part or from the constant part.
    pub(super) fn copy_shared(&self, n: [u16; 6], is_read: bool) -> Option<Planned> {
        let part = self.part()?;
        let own = self.words(n[0], n[1], n[2], PART_BYTES / 4)?;
        let size = 4 * own.count;
        let offset = 4 * (usize::from(n[3]) % ((PART_BYTES - size) / 4 + 1));
        let is_own = !is_read || n[4].is_multiple_of(2);
        let at = part.place(is_own).0 + offset as u64;
        let problems: Vec<_> = own.problem.into_iter().collect();
        let shared = (part.bytes[usize::from(!is_own)], offset);
        let copy = |number| match is_read {
            true => Effect::CopyBytes { from: shared, to: (number, own.offset), size },
            false => Effect::CopyBytes { from: (number, own.offset), to: shared, size },
        };
        let effects = own.number.map(copy).into_iter().collect();
        Some(Planned::new(problems, effects, move |env, cmd| {
            let (buffer, own_at, size) = (*env.shared.buffer, own.offset as u64, size as u64);
            match is_read {
                true => cmd.copy_buffer(buffer, at, own.handle, own_at, size),
                false => cmd.copy_buffer(own.handle, own_at, buffer, at, size),
            }
        }))
    }

    /// Writes words of the own part by a dispatch.
    pub(super) fn dispatch_to_shared(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let part = self.part()?;
        let (offset, size) = words_of_part(n[0], n[1], 64);
        let problems = compute_problems(queue, [None]);
        let bytes = (0..size / 4).flat_map(|index| pattern_word(n[2], index)).collect();
        let effects = match problems.is_empty() {
            true => vec![Effect::Bytes { buffer: part.bytes[0], offset, bytes }],
            false => Vec::new(),
        };
        let (at, seed) = (part.place(true).0 + offset as u64, u32::from(n[2]));
        Some(Planned::new(problems, effects, move |env, cmd| {
            let to = env.ctx().buffer_address(*env.shared.buffer)? + at;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Fill))?;
            cmd.push_constants(&Push { to, number: seed, ..Default::default() })?;
            let writes = Dependencies { buffers: &[*env.shared.buffer], ..Default::default() };
            cmd.dispatch([size as u32 / 4, 1, 1], &writes)
        }))
    }

    /// Copies words of the own part or of the constant part to an own buffer by a dispatch.
    pub(super) fn dispatch_from_shared(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let part = self.part()?;
        let to = self.words(n[0], n[1], n[2], PART_BYTES / 4)?;
        let size = 4 * to.count;
        let offset = 4 * (usize::from(n[3]) % ((PART_BYTES - size) / 4 + 1));
        let is_own = n[4].is_multiple_of(2);
        let problems = compute_problems(queue, [to.problem]);
        let copy = |number| Effect::CopyBytes {
            from: (part.bytes[usize::from(!is_own)], offset),
            to: (number, to.offset),
            size,
        };
        let effects = to.number.filter(|_| problems.is_empty()).map(copy).into_iter().collect();
        let at = part.place(is_own).0 + offset as u64;
        Some(Planned::new(problems, effects, move |env, cmd| {
            let push = Push {
                from: env.ctx().buffer_address(*env.shared.buffer)? + at,
                to: env.ctx().buffer_address(to.handle)? + to.offset as u64,
                ..Default::default()
            };
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Copy))?;
            cmd.push_constants(&push)?;
            let read = [*env.shared.buffer];
            let uses = Dependencies { buffers: &[to.handle], read_buffers: &read, ..Default::default() };
            cmd.dispatch([to.count as u32, 1, 1], &uses)
        }))
    }

    /// Copies between a layer of the shared texture and the own part of the shared buffer.
    pub(super) fn copy_shared_texels(&self, n: [u16; 6], is_read: bool) -> Option<Planned> {
        let part = self.part()?;
        let offset = 4 * (usize::from(n[0]) % ((PART_BYTES - LAYER_BYTES) / 4 + 1));
        let is_own = !is_read || n[1].is_multiple_of(2);
        let place = layer_part(part.images[usize::from(!is_own)]).whole(0);
        let bytes = (part.bytes[0], offset);
        let effect = match is_read {
            true => Effect::ToBuffer { place, to: bytes },
            false => Effect::FromBuffer { from: bytes, place },
        };
        let (at, region) = (part.place(true).0 + offset as u64, region_of(part.place(is_own).1));
        Some(Planned::new(Vec::new(), vec![effect], move |env, cmd| {
            let (buffer, texture) = (*env.shared.buffer, *env.shared.texture);
            match is_read {
                true => cmd.copy_texture_to_buffer(texture, &region, buffer, at),
                false => cmd.copy_buffer_to_texture(buffer, at, texture, &region),
            }
        }))
    }

    /// Stores a word to each texel of the own layer.
    pub(super) fn store_shared(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let part = self.part()?;
        let (texel, word) = texel(lvk::Format::R32Uint, n[0]);
        let problems = compute_problems(queue, [None]);
        let effects = match problems.is_empty() {
            true => vec![Effect::Fill { place: layer_part(part.images[0]).whole(0), texel }],
            false => Vec::new(),
        };
        let (view, index) = (*part.view, part.view.index());
        Some(Planned::new(problems, effects, move |env, cmd| {
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::StoreUint))?;
            cmd.push_constants(&Push { index, word, ..Default::default() })?;
            let writes = Dependencies { storage_images: &[view], ..Default::default() };
            cmd.dispatch([SIDE, SIDE, 1], &writes)
        }))
    }

    /// Fetches the texels of the own layer into an own buffer.
    pub(super) fn fetch_shared(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let part = self.part()?;
        let to = self.exact_words(n[0], n[1], (SIDE * SIDE) as usize)?;
        let problems = compute_problems(queue, [to.problem]);
        let place = layer_part(part.images[0]).whole(0);
        let copy = |number| Effect::ToBuffer { place, to: (number, to.offset) };
        let effects = to.number.filter(|_| problems.is_empty()).map(copy).into_iter().collect();
        let (view, index) = (*part.view, part.view.index());
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::FetchUint))?;
            cmd.push_constants(&Push { to: address, index, ..Default::default() })?;
            let uses = Dependencies { buffers: &[to.handle], sampled_images: &[view], ..Default::default() };
            cmd.dispatch([SIDE, SIDE, 1], &uses)
        }))
    }

    /// Builds the shared BLAS and the shared TLAS anew, of the same triangles.
    pub(super) fn build_shared(&mut self, at: usize) -> Option<Planned> {
        self.part()?;
        self.open[at].builds_shared = true;
        let problems = compute_problems(self.open[at].queue, [None]);
        Some(Planned::new(problems, Vec::new(), |env, cmd| env.shared.build(cmd)))
    }

    /// Traces rays at the shared TLAS.
    pub(super) fn trace_shared(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        self.part()?;
        let to = self.exact_words(n[0], n[1], RAYS)?;
        let problems = compute_problems(queue, [to.problem]);
        let effects = answers_effect(&to, &problems, 0);
        let by_pipeline = n[2] & 1 == 1;
        Some(Planned::new(problems, effects, move |env, cmd| {
            record_trace(env, cmd, &to, env.shared.tlas.index(), by_pipeline)
        }))
    }

    /// Uses an object that any program may destroy meanwhile: copies the buffer or a layer, or traces rays at an instance of
    /// the BLAS. One handle in four is that of the last use, and often stale.
    pub(super) fn use_replaced(&mut self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let part = self.part.as_mut()?;
        if !n[0].is_multiple_of(4) {
            part.replaced = self.env.shared.replaced();
        }
        let (replaced, tlas, index) = (part.replaced, *part.tlas, part.tlas.index());
        let (bytes, image, own) = (part.bytes[2], part.images[2], part.bytes[0]);
        let at = part.place(true).0;
        let planned = match n[1] % 3 {
            0 => {
                let (from, size) = words_of_part(n[2], n[3], PART_BYTES);
                let effect = Effect::CopyBytes { from: (bytes, from), to: (own, from), size };
                Planned::new(Vec::new(), vec![effect], move |env, cmd| {
                    let (from, size) = (from as u64, size as u64);
                    cmd.copy_buffer(replaced.buffer, from, *env.shared.buffer, at + from, size)
                })
            }
            1 => {
                let effect = Effect::ToBuffer { place: layer_part(image).whole(0), to: (own, 0) };
                Planned::new(Vec::new(), vec![effect], move |env, cmd| {
                    cmd.copy_texture_to_buffer(replaced.texture, &region_of(0), *env.shared.buffer, at)
                })
            }
            _ => {
                let to = self.exact_words(n[2], n[3], RAYS)?;
                let problems = compute_problems(queue, [to.problem]);
                let effects = answers_effect(&to, &problems, 1);
                Planned::new(problems, effects, move |env, cmd| {
                    cmd.update_tlas(tlas, &[instance(1, replaced.blas)], BuildMode::Rebuild)?;
                    record_trace(env, cmd, &to, index, false)
                })
            }
        };
        Some(Planned { replaced: Some(replaced.version), ..planned })
    }

    /// Writes bytes of the own part, or texels of the own layer, from the host.
    pub(super) fn upload_shared(&mut self, n: [u16; 6]) -> Outcome {
        let Some(part) = self.part() else { return Ok(false) };
        let (at, layer) = part.place(true);
        let shared = &self.env.shared;
        let effect = if n[0].is_multiple_of(2) {
            let (offset, size) = words_of_part(n[1], n[2], PART_BYTES);
            let bytes = pattern(n[3], size);
            judge(self.ctx().upload_buffer(*shared.buffer, at + offset as u64, &bytes), &[])?;
            Effect::Bytes { buffer: part.bytes[0], offset, bytes }
        } else {
            let bytes = pattern(n[3], LAYER_BYTES);
            judge(self.ctx().upload_texture(*shared.texture, &region_of(layer), &bytes), &[])?;
            Effect::Texels { place: layer_part(part.images[0]).whole(0), bytes }
        };
        self.memory.apply(&self.env.expected(Kind::UploadShared, effect));
        Ok(true)
    }

    /// Reads the own part or layer, or the constant one, at once or later.
    pub(super) fn download_shared(&mut self, n: [u16; 6]) -> Outcome {
        let Some(part) = self.part() else { return Ok(false) };
        let (is_own, is_buffer) = (!n[0].is_multiple_of(4), n[1].is_multiple_of(2));
        if !n[2].is_multiple_of(2) || self.pending.len() >= MOST_PENDING {
            return self.compare_part(part, is_own, is_buffer).map(|()| true);
        }
        let ((at, layer), ctx, shared) = (part.place(is_own), self.ctx(), &self.env.shared);
        let readback = match is_buffer {
            true => ctx.read_buffer_later(*shared.buffer, at..at + PART_BYTES as u64),
            false => ctx.read_texture_later(*shared.texture, &region_of(layer)),
        };
        let expected = self.expected_part(part, is_own, is_buffer);
        self.pending.extend(judge(readback, &[])?.map(|readback| Pending { readback, expected }));
        Ok(true)
    }

    /// Compares the own part and layer at the end of the program.
    pub(super) fn compare_own_part(&self) -> Result<(), String> {
        let Some(part) = self.part() else { return Ok(()) };
        [true, false].into_iter().try_for_each(|is_buffer| self.compare_part(part, true, is_buffer))
    }

    /// Reads a part of the buffer, or a layer of the texture, and compares it with the model.
    fn compare_part(&self, part: &OwnPart<'_>, is_own: bool, is_buffer: bool) -> Result<(), String> {
        let ((at, layer), ctx, shared) = (part.place(is_own), self.ctx(), &self.env.shared);
        let found = match is_buffer {
            true => {
                let mut bytes = vec![0; PART_BYTES];
                ctx.download_buffer(*shared.buffer, at, &mut bytes).map(|()| bytes)
            }
            false => ctx.download_texture(*shared.texture, &region_of(layer)),
        };
        let expected = self.expected_part(part, is_own, is_buffer);
        let what = if is_buffer { "a part of the shared buffer" } else { "a layer of the shared texture" };
        compare(what, &judge(found, &[])?.unwrap_or_default(), &expected)
    }

    /// Returns what the model expects there.
    fn expected_part(&self, part: &OwnPart<'_>, is_own: bool, is_buffer: bool) -> Vec<Cell> {
        let which = usize::from(!is_own);
        if is_buffer {
            return self.memory.buffers[part.bytes[which]].clone();
        }
        let place = layer_part(part.images[which]).whole(0);
        self.memory.images[place.image].read(&place)
    }

    /// Destroys the objects that are replaced, and makes them anew.
    pub(super) fn replace_shared(&self) -> Outcome {
        judge(self.env.shared.replace(self.ctx()), &[]).map(|_| true)
    }
}

/// Returns the effect of rays that meet one instance alone.
fn answers_effect(to: &Words, problems: &[Problem], which: usize) -> Vec<Effect> {
    let answer = |buffer| Effect::Bytes { buffer, offset: to.offset, bytes: answers(which) };
    to.number.filter(|_| problems.is_empty()).map(answer).into_iter().collect()
}
