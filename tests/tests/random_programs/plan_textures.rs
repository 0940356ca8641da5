//! Plans of commands that use textures.

use lvk::{
    ClearValue, ColorAttachment, ColorLoadOp, Dependencies, Filter, Format, Queue, RenderPassDesc,
    TextureHandle, TextureRange, TextureRegion, TextureUsage,
};

use super::cell::{pattern, pattern_byte};
use super::image::{Place, count, texel_bytes};
use super::kit::{Kernel, Push};
use super::memory::Effect;
use super::plan::{Planned, compute_problems, graphics_problems, range, region};
use super::world::{Picked, Problem, TextureInfo, World};

/// Returns the bytes of a texel with a seed, and the word that shaders write for it.
pub(super) fn texel(format: Format, seed: u16) -> (Vec<u8>, u32) {
    let bytes = pattern(seed, 4);
    let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    (bytes[..texel_bytes(format)].to_vec(), word)
}

/// Returns the value that fills texels with [`texel`].
fn clear_value(format: Format, seed: u16) -> ClearValue {
    let (_, word) = texel(format, seed);
    match format {
        Format::R8Uint => ClearValue::Uint([pattern_byte(seed, 0).into(); 4]),
        Format::R32Uint => ClearValue::Uint([word; 4]),
        Format::R32Float => ClearValue::Color([f32::from_bits(word); 4]),
        _ => ClearValue::Color(word.to_le_bytes().map(|byte| f32::from(byte) / 255.0)),
    }
}

/// Returns the operation that clears a target to [`texel`] of a seed, or loads it.
pub(super) fn load_op(format: Format, seed: Option<u16>) -> ColorLoadOp {
    match seed.map(|seed| clear_value(format, seed)) {
        Some(ClearValue::Uint(value)) => ColorLoadOp::ClearUint(value),
        Some(ClearValue::Color(value)) => ColorLoadOp::Clear(value),
        _ => ColorLoadOp::Load,
    }
}

fn is_uint(format: Format) -> bool {
    matches!(format, Format::R8Uint | Format::R32Uint)
}

impl World<'_> {
    pub(super) fn info(&self, texture: &Picked<TextureHandle>) -> Option<&TextureInfo> {
        texture.live.map(|number| &self.textures[number].info)
    }

    /// True for volumes. Copies and blits between textures leave them out.
    pub(super) fn is_volume(&self, texture: &Picked<TextureHandle>) -> bool {
        self.info(texture).is_some_and(|info| info.is_volume)
    }

    /// Returns a region of a texture, its place if it exists, and the problems so far. Slices of volumes are layers of the
    /// place.
    pub(super) fn place(
        &self,
        texture: &Picked<TextureHandle>,
        n: [u16; 2],
    ) -> (TextureRegion, Option<Place>, Vec<Problem>) {
        let Some(info) = self.info(texture) else {
            return (TextureRegion::default(), None, texture.problem.into_iter().collect());
        };
        let mut region = region(&info.part, n);
        let place = info.part.place(&region);
        if info.is_volume {
            (region.z, region.depth) = (region.layer, region.layers);
            (region.layer, region.layers) = (0, 1);
        }
        (region, place, if place.is_some() { Vec::new() } else { vec![Problem::Usage] })
    }

    pub(super) fn update_texture(&self, n: [u16; 6]) -> Option<Planned> {
        let texture = self.pick_texture(n[0])?;
        let (region, place, mut problems) = self.place(&texture, [n[1], n[2]]);
        let format = self.info(&texture).map_or(Format::R32Uint, |info| info.format);
        let mut size = place.map_or(4, |place| place.texels() * texel_bytes(format));
        if n[3] % 24 == 23 {
            size += 1;
            problems.push(Problem::Usage);
        }
        let bytes = pattern(n[4], size);
        let effects = match place {
            Some(place) if problems.is_empty() => vec![Effect::Texels { place, bytes: bytes.clone() }],
            _ => Vec::new(),
        };
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |_, cmd| cmd.update_texture(handle, &region, &bytes)))
    }

    /// Returns an offset in a buffer for the packed texels of a place, and the problem of one that does not fit.
    fn packed_offset(
        &self,
        n: u16,
        buffer: Option<usize>,
        place: Option<Place>,
        format: Format,
    ) -> (u64, Option<Problem>) {
        let size = buffer.map_or(16, |number| self.buffers[number].info.size);
        let bytes = place.map_or(0, |place| place.texels() * texel_bytes(format));
        let (offset, _, _) = range(n, 0, size.saturating_sub(bytes));
        let offset = if n % 17 == 16 { offset } else { offset & !3 };
        let fits = offset % 4 == 0 && offset.checked_add(bytes as u64).is_some_and(|end| end <= size as u64);
        (offset, (!fits).then_some(Problem::Usage))
    }

    pub(super) fn buffer_to_texture(&self, n: [u16; 6]) -> Option<Planned> {
        let (buffer, texture) = (self.pick_buffer(n[0])?, self.pick_texture(n[1])?);
        let (region, place, mut problems) = self.place(&texture, [n[2], n[3]]);
        let format = self.info(&texture).map_or(Format::R32Uint, |info| info.format);
        let (offset, problem) = self.packed_offset(n[4], buffer.live, place, format);
        problems.extend([buffer.problem, problem].into_iter().flatten());
        let effects = match (buffer.live, place) {
            (Some(source), Some(place)) if problems.is_empty() => {
                vec![Effect::FromBuffer { from: (source, offset as usize), place }]
            }
            _ => Vec::new(),
        };
        let (from, to) = (buffer.handle, texture.handle);
        Some(Planned::new(problems, effects, move |_, cmd| {
            cmd.copy_buffer_to_texture(from, offset, to, &region)
        }))
    }

    pub(super) fn texture_to_buffer(&self, n: [u16; 6]) -> Option<Planned> {
        let (buffer, texture) = (self.pick_buffer(n[0])?, self.pick_texture(n[1])?);
        let (region, place, mut problems) = self.place(&texture, [n[2], n[3]]);
        let format = self.info(&texture).map_or(Format::R32Uint, |info| info.format);
        let (offset, problem) = self.packed_offset(n[4], buffer.live, place, format);
        problems.extend([buffer.problem, problem].into_iter().flatten());
        let effects = match (buffer.live, place) {
            (Some(sink), Some(place)) if problems.is_empty() => {
                vec![Effect::ToBuffer { place, to: (sink, offset as usize) }]
            }
            _ => Vec::new(),
        };
        let (to, from) = (buffer.handle, texture.handle);
        Some(Planned::new(problems, effects, move |_, cmd| {
            cmd.copy_texture_to_buffer(from, &region, to, offset)
        }))
    }

    pub(super) fn copy_texture(&self, n: [u16; 6]) -> Option<Planned> {
        let (source, target) = (self.pick_texture(n[0])?, self.pick_texture(n[1])?);
        if self.is_volume(&source) || self.is_volume(&target) {
            return None;
        }
        let (from, from_place, mut problems) = self.place(&source, [n[2], n[3]]);
        let (mut to, _, _) = self.place(&target, [n[4], n[5]]);
        problems.extend(target.problem);
        let to_place = match (from_place, self.info(&target)) {
            (Some(place), Some(info)) => {
                (to.extent, to.layers) = (place.extent, place.layers);
                info.part.place(&to)
            }
            _ => None,
        };
        let formats =
            [&source, &target].map(|texture| self.info(texture).map(|info| texel_bytes(info.format)));
        let differ = matches!(formats, [Some(one), Some(other)] if one != other);
        let meet = matches!((from_place, to_place), (Some(one), Some(other)) if one.meets(&other));
        if differ || meet || (to_place.is_none() && target.problem.is_none()) {
            problems.push(Problem::Usage);
        }
        let effects = match (from_place, to_place) {
            (Some(from), Some(to)) if problems.is_empty() => vec![Effect::CopyTexels { from, to }],
            _ => Vec::new(),
        };
        let (source, target) = (source.handle, target.handle);
        Some(Planned::new(problems, effects, move |_, cmd| cmd.copy_texture(source, &from, target, &to)))
    }

    pub(super) fn clear_texture(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let texture = self.pick_texture(n[0])?;
        let mut problems = compute_problems(queue, [texture.problem]);
        let info = self.info(&texture);
        let format = info.map_or(Format::R32Uint, |info| info.format);
        let range = TextureRange {
            base_mip: u32::from(n[1] % 3),
            mips: u32::from(n[2] % 3),
            base_layer: u32::from(n[3] % 8 / 6),
            layers: u32::from(n[4] % 8 / 6),
        };
        let value = if n[5] % 16 == 15 {
            problems.push(Problem::Usage);
            ClearValue::Depth(0.5)
        } else {
            clear_value(format, n[5])
        };
        let (bytes, _) = texel(format, n[5]);
        let places = info.and_then(|info| {
            let mips = count(range.base_mip, range.mips, info.part.mips)?;
            // A volume has one layer, with all slices.
            let whole = if info.is_volume { 1 } else { info.part.layers };
            let layers = count(range.base_layer, range.layers, whole)?;
            let layers = if info.is_volume { info.part.layers } else { layers };
            let layer = info.part.base_layer + range.base_layer;
            let place = |mip| Place { layer, layers, ..info.part.whole(mip) };
            Some((range.base_mip..range.base_mip + mips).map(place).collect::<Vec<_>>())
        });
        if places.is_none() && texture.problem.is_none() {
            problems.push(Problem::Usage);
        }
        let effects = match places {
            Some(places) if problems.is_empty() => {
                places.into_iter().map(|place| Effect::Fill { place, texel: bytes.clone() }).collect()
            }
            _ => Vec::new(),
        };
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |_, cmd| cmd.clear_texture(handle, value, &range)))
    }

    /// Plans a blit of one size or of twice the size, to the nearest texel. Conversions are not modelled.
    pub(super) fn blit(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (source, target) = (self.pick_texture(n[0])?, self.pick_texture(n[1])?);
        if self.is_volume(&source) || self.is_volume(&target) {
            return None;
        }
        let (from, from_place, from_problems) = self.place(&source, [n[2], n[3]]);
        let (mut to, mut to_place, _) = self.place(&target, [n[4], n[5]]);
        let mut problems = graphics_problems(queue, [target.problem]);
        problems.extend(from_problems);
        if let (Some(place), Some(info)) = (from_place, self.info(&target)) {
            to.layers = place.layers;
            let sized = |factor: u32| TextureRegion { extent: place.extent.map(|side| side * factor), ..to };
            let double = sized(2);
            to = if info.part.place(&double).is_some() { double } else { sized(1) };
            to_place = info.part.place(&to);
        }
        if to_place.is_none() && target.problem.is_none() {
            problems.push(Problem::Usage);
        }
        if let (Some(one), Some(other)) = (self.info(&source), self.info(&target)) {
            if is_uint(one.format) != is_uint(other.format) {
                problems.push(Problem::Unsupported);
            } else if one.format != other.format {
                return None;
            }
            let supported = self.ctx().format_support(one.format).ok()?;
            if !supported.blit_source || !supported.blit_target {
                problems.push(Problem::Unsupported);
            }
        }
        if matches!((from_place, to_place), (Some(one), Some(other)) if one.meets(&other) || one.layers != other.layers)
        {
            problems.push(Problem::Usage);
        }
        let effects = match (from_place, to_place) {
            (Some(from), Some(to)) if problems.is_empty() => vec![Effect::Scale { from, to }],
            _ => Vec::new(),
        };
        let (source, target) = (source.handle, target.handle);
        Some(Planned::new(problems, effects, move |_, cmd| {
            cmd.blit_texture(source, &from, target, &to, Filter::Nearest)
        }))
    }

    pub(super) fn mipmaps(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let texture = self.pick_texture(n[0])?;
        let mut problems = graphics_problems(queue, [texture.problem]);
        let info = self.info(&texture);
        if let Some(info) = info {
            let supported = self.ctx().format_support(info.format).ok()?;
            if !(supported.linear && supported.blit_source && supported.blit_target) {
                problems.push(Problem::Unsupported);
            }
        }
        let effects = match info {
            Some(info) if problems.is_empty() => {
                vec![Effect::Mips { first: info.part.whole(0), mips: info.part.mips }]
            }
            _ => Vec::new(),
        };
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |_, cmd| cmd.generate_mipmaps(handle)))
    }

    /// Chooses a texture that is an element of the arrays of 2D textures, and the problem of one without `usage`.
    pub(super) fn flat_texture(
        &self,
        n: u16,
        usage: TextureUsage,
    ) -> Option<(Picked<TextureHandle>, Option<Problem>)> {
        let texture = self.pick_texture(n)?;
        let info = self.info(&texture);
        if info.is_some_and(|info| info.is_array) {
            return None;
        }
        let lacks = info.is_some_and(|info| !info.usage.contains(usage));
        Some((texture, lacks.then_some(Problem::Usage)))
    }

    pub(super) fn store_image(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (texture, lack) = self.flat_texture(n[0], TextureUsage::STORAGE)?;
        let problems = compute_problems(queue, [texture.problem, lack]);
        let info = self.info(&texture);
        let format = info.map_or(Format::R32Uint, |info| info.format);
        let kernel = match format {
            Format::R32Uint | Format::R8Uint => Kernel::StoreUint,
            Format::R32Float => Kernel::StoreFloat,
            _ => Kernel::StoreBytes,
        };
        let (bytes, word) = texel(format, n[1]);
        let place = info.map(|info| info.part.whole(0));
        let index = texture.live.map_or(0, |number| self.textures[number].index);
        let effects = match place {
            Some(place) if problems.is_empty() => vec![Effect::Fill { place, texel: bytes }],
            _ => Vec::new(),
        };
        let [width, height] = place.map_or([1, 1], |place| place.extent);
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |env, cmd| {
            cmd.bind_compute_pipeline(env.kit.kernel(kernel))?;
            cmd.push_constants(&Push { index, word, ..Default::default() })?;
            let writes = Dependencies { storage_images: &[handle], ..Default::default() };
            cmd.dispatch([width, height, 1], &writes)
        }))
    }

    pub(super) fn fetch_texture(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let (texture, lack) = self.flat_texture(n[0], TextureUsage::SAMPLED)?;
        let info = self.info(&texture);
        let mip = info.map_or(0, |info| u32::from(n[1]) % info.part.mips);
        let place = info.map(|info| info.part.whole(mip));
        let [width, height] = place.map_or([1, 1], |place| place.extent);
        let texels = (width * height) as usize;
        let to = self.exact_words(n[2], n[3], texels)?;
        if info.is_some_and(|info| texel_bytes(info.format) != 4) {
            return None;
        }
        let problems = compute_problems(queue, [texture.problem, lack, to.problem]);
        let kernel = match info.map(|info| info.format) {
            Some(Format::R32Float) => Kernel::FetchFloat,
            Some(Format::Rgba8Unorm) => Kernel::FetchBytes,
            _ => Kernel::FetchUint,
        };
        let index = texture.live.map_or(0, |number| self.textures[number].index);
        let effects = match (place, to.number) {
            (Some(place), Some(number)) if problems.is_empty() => {
                vec![Effect::ToBuffer { place, to: (number, to.offset) }]
            }
            _ => Vec::new(),
        };
        let handle = texture.handle;
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            cmd.bind_compute_pipeline(env.kit.kernel(kernel))?;
            cmd.push_constants(&Push { to: address, index, number: mip, ..Default::default() })?;
            let uses =
                Dependencies { buffers: &[to.handle], sampled_images: &[handle], ..Default::default() };
            cmd.dispatch([width, height, 1], &uses)
        }))
    }

    /// Plans a pass that clears or loads one mip of a layer, and fills a rectangle.
    pub(super) fn draw(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let texture = self.pick_texture(n[0])?;
        let (region, place, place_problems) = self.place(&texture, [n[1], n[2] | 1]);
        let info = self.info(&texture);
        let lack = info.is_some_and(|info| !info.usage.contains(TextureUsage::TARGET));
        if lack && place.is_none() {
            return None;
        }
        let only_extent_is_wrong = info
            .is_some_and(|info| region.mip < info.part.mips && region.layer + region.z < info.part.layers);
        // A wrong rectangle is refused after the pass has begun, which clears.
        let clears = n[5] & 1 == 1;
        if place.is_none() && only_extent_is_wrong && (clears || region.extent[0] == 0) {
            return None;
        }
        let mut problems = graphics_problems(queue, [texture.problem, lack.then_some(Problem::Usage)]);
        problems.extend(
            place_problems.into_iter().filter(|problem| !problems.contains(problem)).collect::<Vec<_>>(),
        );
        let format = info.map_or(Format::R32Uint, |info| info.format);
        let (drawn, word) = texel(format, n[4]);
        let effects = match (info, place) {
            (Some(info), Some(place)) if problems.is_empty() => {
                let one_layer = Place { layers: 1, ..place };
                let whole = Place { layer: place.layer, layers: 1, ..info.part.whole(region.mip) };
                let clear = clears.then_some(Effect::Fill { place: whole, texel: texel(format, n[3]).0 });
                clear.into_iter().chain([Effect::Fill { place: one_layer, texel: drawn }]).collect()
            }
            _ => Vec::new(),
        };
        let load = load_op(format, clears.then_some(n[3]));
        let TextureRegion { mip, offset, extent, .. } = region;
        let layer = region.layer + region.z;
        let target =
            ColorAttachment { texture: texture.handle, mip, layer, load, store: true, resolve: None };
        Some(Planned::new(problems, effects, move |env, cmd| {
            let mut pass = cmd.begin_rendering(&RenderPassDesc { color: &[target], ..Default::default() })?;
            pass.bind_render_pipeline(env.kit.draw(format))?;
            pass.push_constants(&Push { word, ..Default::default() })?;
            pass.scissor(offset, extent)?;
            pass.draw(0..3, 0..1)
        }))
    }
}
