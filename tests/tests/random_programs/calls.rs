//! Calls of the context on buffers, textures and acceleration structures.

use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferUsage, BuildFlags, Format, MemoryKind, SamplerDesc,
    TextureDesc, TextureKind, TextureUsage, TextureViewDesc, TlasDesc, Triangles,
};

use super::cell::{Cell, compare, known, pattern};
use super::image::{Image, Part, mip_extent, texel_bytes};
use super::memory::{Blas, Effect, Tlas};
use super::op::Kind;
use super::plan::range;
use super::plan_rays::{triangle_bytes, triangle_depth};
use super::world::{BlasInfo, BufferInfo, Object, Pending, Problem, TextureInfo, TlasInfo, World, judge};

pub(super) type Outcome = Result<bool, String>;

/// Most live objects of a kind.
pub(super) const MOST: usize = 12;
/// Most readbacks that are not finished.
pub(super) const MOST_PENDING: usize = 6;

impl World<'_> {
    pub(super) fn create_buffer(&mut self, n: [u16; 6]) -> Outcome {
        if self.buffers.iter().filter(|buffer| buffer.holder.is_some()).count() >= MOST {
            return Ok(false);
        }
        let size = if n[0] % 24 == 23 { 0 } else { 1 + usize::from(n[0]) % 200 };
        let memory = match n[1] % 6 {
            0 => MemoryKind::HostVisible,
            1 => MemoryKind::Readback,
            _ => MemoryKind::Device,
        };
        let data = match n[2] % 16 {
            0..8 => Some(pattern(n[3], size)),
            8..12 => Some(pattern(n[3], usize::from(n[4]) % (size + 1))),
            12 => Some(pattern(n[3], size + 1)),
            _ => None,
        };
        let given = data.as_ref().map_or(0, Vec::len);
        let problem = if size == 0 { given == 0 } else { given > size };
        let problems: Vec<_> = problem.then_some(Problem::Usage).into_iter().collect();
        let size_bytes = size as u64;
        let size = if size == 0 { given } else { size };
        let made = self.ctx().create_buffer(&BufferDesc {
            size_bytes,
            usage: BufferUsage::STORAGE,
            memory,
            data: data.as_deref(),
            debug_name: "random buffer",
        });
        if let Some(holder) = judge(made, &problems)? {
            let mut cells = vec![Cell::UNKNOWN; size];
            cells[..given].copy_from_slice(&known(data.as_deref().unwrap_or_default()));
            self.memory.buffers.push(cells);
            self.buffers.push(Object::new(holder, BufferInfo { size, memory }));
        }
        Ok(true)
    }

    /// Waits before the host writes memory that the GPU may use.
    pub(super) fn wait_before_host_write(&self, memory: Option<MemoryKind>) -> Result<(), String> {
        if memory.is_some_and(|memory| memory != MemoryKind::Device) {
            self.ctx().wait_idle().map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    pub(super) fn upload_buffer(&mut self, n: [u16; 6]) -> Outcome {
        let Some(buffer) = self.pick_buffer(n[0]) else { return Ok(false) };
        let info = buffer.live.map(|number| self.buffers[number].info);
        let (offset, size, inside) = range(n[1], n[2], info.map_or(16, |info| info.size));
        let mut problems: Vec<_> = buffer.problem.into_iter().collect();
        if !inside {
            problems.push(Problem::Usage);
        }
        self.wait_before_host_write(info.map(|info| info.memory))?;
        let bytes = pattern(n[3], size as usize);
        let written = self.ctx().upload_buffer(buffer.handle, offset, &bytes);
        if let (Some(()), Some(buffer)) = (judge(written, &problems)?, buffer.live) {
            let effect = Effect::Bytes { buffer, offset: offset as usize, bytes };
            self.memory.apply(&self.env.expected(Kind::UploadBuffer, effect));
        }
        Ok(true)
    }

    pub(super) fn download_buffer(&mut self, n: [u16; 6], is_later: bool) -> Outcome {
        let Some(buffer) = self.pick_buffer(n[0]) else { return Ok(false) };
        if is_later && self.pending.len() >= MOST_PENDING {
            return Ok(false);
        }
        let size = buffer.live.map_or(16, |number| self.buffers[number].info.size);
        let (offset, length, inside) = range(n[1], n[2], size);
        let mut problems: Vec<_> = buffer.problem.into_iter().collect();
        let is_reversed = is_later && n[3] % 24 == 23 && length > 0;
        if !inside || is_reversed {
            problems.push(Problem::Usage);
        }
        let expected = || match buffer.live {
            Some(number) => self.memory.buffers[number][offset as usize..(offset + length) as usize].to_vec(),
            None => Vec::new(),
        };
        if is_later {
            let end = offset.saturating_add(length);
            let bytes = if is_reversed { end..offset } else { offset..end };
            let begun = self.ctx().read_buffer_later(buffer.handle, bytes);
            if let Some(readback) = judge(begun, &problems)? {
                let expected = expected();
                self.pending.push(Pending { readback, expected });
            }
            return Ok(true);
        }
        let mut bytes = vec![0; length as usize];
        if judge(self.ctx().download_buffer(buffer.handle, offset, &mut bytes), &problems)?.is_some() {
            compare("a buffer", &bytes, &expected())?;
        }
        Ok(true)
    }

    pub(super) fn buffer_address(&mut self, n: [u16; 6]) -> Outcome {
        let Some(buffer) = self.pick_buffer(n[0]) else { return Ok(false) };
        let size = buffer.live.map_or(16, |number| self.buffers[number].info.size);
        let problems: Vec<_> = buffer.problem.into_iter().collect();
        let base = judge(self.ctx().buffer_address(buffer.handle), &problems)?;
        let at = u64::from(n[1]) % (size as u64 + 2);
        let mut beyond = problems;
        if at >= size as u64 {
            beyond.push(Problem::Usage);
        }
        let found = judge(self.ctx().buffer_address_at(buffer.handle, at), &beyond)?;
        if found.is_some() && found != base.map(|base| base + at) {
            return Err(format!("address {found:x?} of byte {at}, first byte at {base:x?}"));
        }
        Ok(true)
    }

    pub(super) fn create_texture(&mut self, n: [u16; 6]) -> Outcome {
        if self.textures.iter().filter(|texture| texture.holder.is_some()).count() >= MOST {
            return Ok(false);
        }
        let (info, mut problems) = choose_texture(n, self.memory.images.len());
        let TextureInfo { part, format, usage, is_array, .. } = info;
        let Part { mips, layers, extent, .. } = part;
        let bytes: usize = (0..mips).map(|mip| part.whole(mip).texels() * texel_bytes(format)).sum();
        let data = n[5].is_multiple_of(3).then(|| pattern(n[5], bytes + usize::from(n[5] % 32 == 3)));
        if data.as_ref().is_some_and(|data| data.len() != bytes) {
            problems.push(Problem::Usage);
        }
        let made = self.ctx().create_texture(&TextureDesc {
            kind: if is_array { TextureKind::D2Array { layers } } else { TextureKind::D2 },
            format,
            extent,
            mips,
            usage,
            data: data.as_deref(),
            data_mips: 0,
            debug_name: "random texture",
            ..Default::default()
        });
        if let Some(holder) = judge(made, &problems)? {
            self.memory.images.push(Image::new(format, extent, layers, mips));
            self.fill_mips(&info, data.as_deref().unwrap_or_default());
            self.textures.push(Object::new(holder, info));
        }
        Ok(true)
    }

    /// Writes the initial contents of a texture, as far as they reach, mip by mip.
    pub(super) fn fill_mips(&mut self, info: &TextureInfo, mut data: &[u8]) {
        for mip in 0..info.part.mips {
            let place = info.part.whole(mip);
            let (own, others) = data.split_at(data.len().min(place.texels() * texel_bytes(info.format)));
            if !own.is_empty() {
                self.memory.apply(&Effect::Texels { place, bytes: own.to_vec() });
            }
            data = others;
        }
    }

    pub(super) fn create_view(&mut self, n: [u16; 6]) -> Outcome {
        let Some(texture) = self.pick_texture(n[0]) else { return Ok(false) };
        if self.textures.iter().filter(|texture| texture.holder.is_some()).count() >= MOST {
            return Ok(false);
        }
        let info = texture.live.map(|number| self.textures[number].info);
        let mut problems: Vec<_> = texture.problem.into_iter().collect();
        let (base_mip, mips) = (u32::from(n[1] % 4), u32::from(n[2] % 3));
        let base_layer = u32::from(n[3] % 3);
        let is_flat = n[4].is_multiple_of(2);
        let mut view = None;
        if let Some(info) = info {
            let part = info.part;
            let is_array = info.is_array && !is_flat;
            let is_cube = info.is_cube && is_array;
            let rest = part.layers.saturating_sub(base_layer);
            let layers = match (info.is_volume, is_cube, is_array) {
                (true, _, _) => part.layers,
                (_, true, _) => 6,
                (_, _, true) => rest,
                _ => 1,
            };
            let mip_count = super::image::count(base_mip, mips, part.mips);
            let is_slice = info.is_volume && is_flat;
            let fits = layers > 0 && base_layer + layers <= part.layers && !is_slice;
            match mip_count.filter(|_| fits) {
                Some(mips) => {
                    let (base_mip, base_layer) = (part.base_mip + base_mip, part.base_layer + base_layer);
                    let part = Part { base_mip, mips, base_layer, layers, ..part };
                    view = Some(TextureInfo { part, is_array, is_cube, ..info });
                }
                None => problems.push(Problem::Usage),
            }
        }
        let made = self.ctx().create_texture_view(&TextureViewDesc {
            texture: Some(texture.handle),
            kind: is_flat.then_some(TextureKind::D2),
            base_mip,
            mips,
            base_layer,
            debug_name: "random view",
            ..Default::default()
        });
        if let (Some(holder), Some(view)) = (judge(made, &problems)?, view) {
            self.textures.push(Object::new(holder, view));
        }
        Ok(true)
    }

    pub(super) fn upload_texture(&mut self, n: [u16; 6]) -> Outcome {
        let Some(texture) = self.pick_texture(n[0]) else { return Ok(false) };
        let (region, place, mut problems) = self.place(&texture, [n[1], n[2]]);
        let texel = texture.live.map_or(4, |number| texel_bytes(self.textures[number].info.format));
        let mut size = place.map_or(4, |place| place.texels() * texel);
        if n[3] % 24 == 23 {
            size += 1;
            problems.push(Problem::Usage);
        }
        let bytes = pattern(n[4], size);
        let written = self.ctx().upload_texture(texture.handle, &region, &bytes);
        if let (Some(()), Some(place)) = (judge(written, &problems)?, place) {
            self.memory.apply(&self.env.expected(Kind::UploadTexture, Effect::Texels { place, bytes }));
        }
        Ok(true)
    }

    pub(super) fn download_texture(&mut self, n: [u16; 6], is_later: bool) -> Outcome {
        let Some(texture) = self.pick_texture(n[0]) else { return Ok(false) };
        if is_later && self.pending.len() >= MOST_PENDING {
            return Ok(false);
        }
        let (region, place, problems) = self.place(&texture, [n[1], n[2]]);
        let expected = place.map(|place| self.memory.images[place.image].read(&place)).unwrap_or_default();
        if is_later {
            let begun = self.ctx().read_texture_later(texture.handle, &region);
            if let Some(readback) = judge(begun, &problems)? {
                self.pending.push(Pending { readback, expected });
            }
        } else if let Some(bytes) = judge(self.ctx().download_texture(texture.handle, &region), &problems)? {
            compare("a texture", &bytes, &expected)?;
        }
        Ok(true)
    }

    pub(super) fn create_sampler(&mut self) -> Outcome {
        if self.samplers.len() < 40 {
            let made = self
                .ctx()
                .create_sampler(&SamplerDesc { debug_name: "random sampler", ..Default::default() });
            self.samplers.extend(judge(made, &[])?.map(|holder| Object::new(holder, None)));
        }
        Ok(true)
    }

    pub(super) fn create_mesh(&mut self, n: [u16; 6]) -> Outcome {
        if self.meshes.iter().filter(|mesh| mesh.holder.is_some()).count() >= MOST / 2 {
            return Ok(false);
        }
        let count = 1 + usize::from(n[0] % 3);
        let depths: Vec<u32> = (0..count).map(|triangle| triangle_depth(n[1 + triangle])).collect();
        let data: Vec<u8> = depths
            .iter()
            .enumerate()
            .flat_map(|(triangle, depth)| triangle_bytes(triangle, *depth))
            .collect();
        let made = self.ctx().create_buffer(&BufferDesc {
            usage: BufferUsage::ACCEL_INPUT,
            data: Some(&data),
            debug_name: "random mesh",
            ..Default::default()
        });
        if let Some(holder) = judge(made, &[])? {
            self.memory.meshes.push(depths);
            self.meshes.push(Object::new(holder, count));
        }
        Ok(true)
    }

    pub(super) fn upload_mesh(&mut self, n: [u16; 6]) -> Outcome {
        let Some(mesh) = self.pick_mesh(n[0]) else { return Ok(false) };
        let triangle = mesh.live.map_or(0, |number| usize::from(n[1]) % self.meshes[number].info);
        let depth = triangle_depth(n[2]);
        let bytes = triangle_bytes(triangle, depth);
        let written = self.ctx().upload_buffer(mesh.handle, 36 * triangle as u64, &bytes);
        let problems: Vec<_> = mesh.problem.into_iter().collect();
        if let (Some(()), Some(mesh)) = (judge(written, &problems)?, mesh.live) {
            let effect = Effect::Move { mesh, triangle, depth };
            self.memory.apply(&self.env.expected(Kind::UploadMesh, effect));
        }
        Ok(true)
    }

    pub(super) fn create_blas(&mut self, n: [u16; 6]) -> Outcome {
        let Some(mesh) = self.pick_mesh(n[0]) else { return Ok(false) };
        if self.blas.iter().filter(|blas| blas.holder.is_some()).count() >= MOST / 2 {
            return Ok(false);
        }
        let mut flags =
            [BuildFlags::FAST_TRACE, BuildFlags::FAST_BUILD, BuildFlags::LOW_MEMORY][usize::from(n[2] % 3)];
        flags.set(BuildFlags::ALLOW_UPDATE, n[1] & 1 == 1);
        flags.set(BuildFlags::ALLOW_COMPACTION, n[1] & 2 == 2);
        let mut problems: Vec<_> = mesh.problem.into_iter().collect();
        if n[3] % 24 == 23 {
            flags |= BuildFlags::FAST_TRACE | BuildFlags::FAST_BUILD;
            problems.push(Problem::Usage);
        }
        let mut vertices = mesh.live.map_or(3, |number| 3 * self.meshes[number].info as u32);
        if n[4] % 24 == 23 {
            vertices += 3;
            problems.push(Problem::Usage);
        }
        let geometries = [BlasGeometry::Triangles(Triangles::packed(mesh.handle, vertices))];
        let desc =
            BlasDesc { geometries: &geometries, flags, debug_name: "random BLAS", ..Default::default() };
        let made = self.ctx().create_blas(&desc);
        if let (Some(holder), Some(mesh)) = (judge(made, &problems)?, mesh.live) {
            self.memory.blas.push(Blas { mesh, ..Default::default() });
            let effect = Effect::Build { blas: self.blas.len() };
            self.memory.apply(&self.env.expected(Kind::CreateBlas, effect));
            self.blas.push(Object::new(holder, BlasInfo { mesh, flags, was_compacted: false }));
        }
        Ok(true)
    }

    pub(super) fn create_tlas(&mut self, n: [u16; 6]) -> Outcome {
        if self.tlas.iter().filter(|tlas| tlas.holder.is_some()).count() >= MOST / 3 {
            return Ok(false);
        }
        let (raw, known, mut problems) = self.instances([n[0], n[1], n[2]], 3);
        let is_updatable = n[3] & 1 == 1;
        let mut flags = [BuildFlags::FAST_TRACE, BuildFlags::FAST_BUILD][usize::from(n[3] >> 1 & 1)];
        flags.set(BuildFlags::ALLOW_UPDATE, is_updatable);
        if n[4] % 24 == 23 {
            flags |= BuildFlags::ALLOW_COMPACTION;
            problems.push(Problem::Usage);
        }
        let capacity = u32::from(n[5] % 5);
        let desc =
            TlasDesc { instances: &raw, capacity, flags, debug_name: "random TLAS", ..Default::default() };
        self.record_problems(&problems);
        if let Some(holder) = judge(self.ctx().create_tlas(&desc), &problems)? {
            let tlas = self.memory.tlas.len();
            self.memory.tlas.push(Tlas::default());
            let effect = Effect::Place { tlas, instances: known };
            self.memory.apply(&self.env.expected(Kind::CreateTlas, effect));
            let count = raw.len() as u32;
            let info = TlasInfo { capacity: capacity.max(count), is_updatable, count };
            self.tlas.push(Object::new(holder, info));
        }
        Ok(true)
    }

    pub(super) fn compact(&mut self, n: [u16; 6]) -> Outcome {
        let Some(blas) = self.pick_blas(n[0]) else { return Ok(false) };
        let mut problems: Vec<_> = blas.problem.into_iter().collect();
        if blas.live.is_some_and(|number| !self.blas[number].info.can_compact()) {
            problems.push(Problem::Usage);
        }
        self.record_problems(&problems);
        if let (Some(()), Some(number)) = (judge(self.ctx().compact(&[blas.handle]), &problems)?, blas.live) {
            self.blas[number].info.was_compacted = true;
        }
        Ok(true)
    }

    pub(super) fn accel_info(&mut self, n: [u16; 6]) -> Outcome {
        let Some(blas) = self.pick_blas(n[0]) else { return Ok(false) };
        let problems: Vec<_> = blas.problem.into_iter().collect();
        self.record_problems(&problems);
        let found = judge(self.ctx().accel_struct_info(blas.handle), &problems)?;
        if found.is_some_and(|info| info.is_top_level || info.parts != 1 || info.name != "random BLAS") {
            return Err("the BLAS is described wrongly".to_owned());
        }
        Ok(true)
    }
}

/// Returns a texture with this number of its image, mostly one that can be created, and its problems.
pub(super) fn choose_texture(n: [u16; 6], image: usize) -> (TextureInfo, Vec<Problem>) {
    const SIDES: [u32; 7] = [1, 2, 3, 4, 5, 6, 8];
    const FORMATS: [Format; 4] = [Format::R32Uint, Format::Rgba8Unorm, Format::R32Float, Format::R8Uint];
    let format = FORMATS[usize::from(n[0] % 4)];
    let usage = match n[1] % 8 {
        _ if format == Format::R8Uint => TextureUsage::SAMPLED,
        0 => TextureUsage::SAMPLED,
        1 => TextureUsage::STORAGE,
        2 => TextureUsage::TARGET,
        3 => TextureUsage::empty(),
        _ => TextureUsage::SAMPLED | TextureUsage::STORAGE | TextureUsage::TARGET,
    };
    let mut extent = [n[2], n[2] >> 4].map(|bits| SIDES[usize::from(bits) % SIDES.len()]);
    let is_array = n[3].is_multiple_of(4);
    let layers = if is_array { 1 + u32::from(n[3] >> 2) % 3 } else { 1 };
    let full = 32 - extent[0].max(extent[1]).leading_zeros();
    let mut mips = 1 + u32::from(n[4]) % full.min(3);
    let mut problems: Vec<_> = usage.is_empty().then_some(Problem::Usage).into_iter().collect();
    match n[5] % 32 {
        0 => extent[0] = 0,
        1 => mips = full + 1,
        _ => {}
    }
    if n[5] % 32 < 2 {
        problems.push(Problem::Usage);
    }
    let part = Part { image, base_mip: 0, mips, base_layer: 0, layers, extent };
    (TextureInfo { part, format, usage, is_array, is_cube: false, is_volume: false }, problems)
}

/// Extents are those of the mips; keeps the model's halving next to its users.
#[test]
fn mips_are_halved_down_to_one_texel() {
    assert_eq!([0, 1, 2, 40].map(|mip| mip_extent([5, 2], mip)), [[5, 2], [2, 1], [1, 1], [1, 1]]);
}
