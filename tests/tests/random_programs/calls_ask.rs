//! Calls of the context on mapped memory, samplers that take the nearest texel, cubes, and questions.

use lvk::{AddressMode, Filter, MemoryKind, Queue, SamplerDesc, TextureDesc, TextureKind, TextureUsage};
use lvk_tests::accel_backend::builds_device_accel_structs;

use super::calls::{MOST, Outcome, choose_texture};
use super::cell::{compare, pattern};
use super::image::{Image, Part, texel_bytes};
use super::memory::Effect;
use super::op::Kind;
use super::plan::range;
use super::world::{Object, Problem, TextureInfo, World, judge};

/// Address modes of samplers.
const MODES: [AddressMode; 3] = [AddressMode::Repeat, AddressMode::MirroredRepeat, AddressMode::ClampToEdge];

impl World<'_> {
    /// Maps a buffer, compares its bytes, and writes some of them in place.
    pub(super) fn map_buffer(&mut self, n: [u16; 6]) -> Outcome {
        let Some(buffer) = self.pick_buffer(n[0]) else { return Ok(false) };
        let info = buffer.live.map(|number| self.buffers[number].info);
        let mut problems: Vec<_> = buffer.problem.into_iter().collect();
        let is_unmapped = info.is_some_and(|info| info.memory == MemoryKind::Device);
        problems.extend(is_unmapped.then_some(Problem::Usage));
        self.wait_before_host_write(info.map(|info| info.memory))?;
        self.record_problems(&problems);
        let mapped = judge(self.ctx().map_buffer(buffer.handle), &problems)?;
        let (Some(mut mapped), Some(number)) = (mapped, buffer.live) else { return Ok(true) };
        // SAFETY: the buffer is alive, the GPU is done with it, and only this thread uses it.
        let bytes = unsafe { mapped.as_mut() };
        compare("a mapped buffer", bytes, &self.memory.buffers[number])?;
        let (offset, size, is_inside) = range(n[1], n[2], bytes.len());
        if is_inside {
            let (offset, written) = (offset as usize, pattern(n[3], size as usize));
            bytes[offset..offset + written.len()].copy_from_slice(&written);
            let effect = Effect::Bytes { buffer: number, offset, bytes: written };
            self.memory.apply(&self.env.expected(Kind::MapBuffer, effect));
        }
        Ok(true)
    }

    pub(super) fn create_nearest_sampler(&mut self, n: [u16; 6]) -> Outcome {
        if self.samplers.len() >= 40 {
            return Ok(true);
        }
        let mode = MODES[usize::from(n[0]) % MODES.len()];
        let made = self.ctx().create_sampler(&SamplerDesc {
            mag_filter: Filter::Nearest,
            min_filter: Filter::Nearest,
            mip_filter: Filter::Nearest,
            address: [mode; 3],
            debug_name: "nearest sampler",
            ..Default::default()
        });
        self.record_problems(&[]);
        self.samplers.extend(judge(made, &[])?.map(|holder| Object::new(holder, Some(mode))));
        Ok(true)
    }

    /// Creates a cube or a volume, whose faces or slices are layers of the model.
    pub(super) fn create_solid(&mut self, n: [u16; 6], is_volume: bool) -> Outcome {
        if self.textures.iter().filter(|texture| texture.holder.is_some()).count() >= MOST {
            return Ok(false);
        }
        let image = self.memory.images.len();
        let (info, mut problems) = choose_texture([n[0], n[1], n[2], 1, n[4], n[5]], image);
        let TextureInfo { part, format, usage, .. } = info;
        let Part { mut extent, mut mips, .. } = part;
        if is_volume {
            // The chain of a volume may be longer than that of its slices.
            mips = if problems.is_empty() { 1 } else { mips + 2 };
        } else {
            extent[1] = extent[0];
            let full = 32 - extent[0].leading_zeros();
            mips = if problems.is_empty() { mips.min(full) } else { mips };
        }
        let layers = if is_volume { u32::from(n[3] / 16 % 4) } else { 6 };
        let is_oblong = !is_volume && n[3] % 16 == 15;
        extent[1] += u32::from(is_oblong);
        problems.extend((is_oblong || layers == 0).then_some(Problem::Usage));
        let part = Part { mips, layers, extent, ..part };
        let bytes = (0..mips).map(|mip| part.whole(mip).texels() * texel_bytes(format)).sum();
        let data = (n[3] % 16 < 8).then(|| pattern(n[3], bytes));
        self.record_problems(&problems);
        let made = self.ctx().create_texture(&TextureDesc {
            kind: if is_volume { TextureKind::D3 { depth: layers } } else { TextureKind::Cube },
            format,
            extent,
            mips,
            usage,
            data: data.as_deref(),
            data_mips: 0,
            debug_name: "random solid",
            ..Default::default()
        });
        if let Some(holder) = judge(made, &problems)? {
            let info = TextureInfo { part, is_array: true, is_cube: !is_volume, is_volume, ..info };
            self.memory.images.push(Image::new(format, extent, layers, mips));
            self.fill_mips(&info, data.as_deref().unwrap_or_default());
            self.textures.push(Object::new(holder, info));
        }
        Ok(true)
    }

    /// Asks what changes nothing that the model knows.
    pub(super) fn ask_context(&mut self, n: [u16; 6]) -> Outcome {
        let ctx = self.ctx();
        match n[0] % 8 {
            0 => return self.ask_for_buffer(n),
            1 => {
                let (info, problems) = choose_texture(n, 0);
                let TextureInfo { part, format, usage, is_array, .. } = info;
                let layers = part.layers;
                let kind = if is_array { TextureKind::D2Array { layers } } else { TextureKind::D2 };
                let (extent, mips) = (part.extent, part.mips);
                let desc = TextureDesc { kind, format, extent, mips, usage, ..Default::default() };
                self.record_problems(&problems);
                judge(ctx.supports_texture(&desc), &problems)?;
                return Ok(true);
            }
            2 => {
                let queue = [Queue::Graphics, Queue::Compute, Queue::Transfer][usize::from(n[1]) % 3];
                ctx.push_queue_label(queue, "part");
                ctx.insert_queue_label(queue, "here");
                ctx.pop_queue_label(queue);
            }
            3 => {
                judge(ctx.set_profiling(n[1].is_multiple_of(2)), &[])?;
            }
            4 => {
                judge(ctx.last_profile(), &[])?;
            }
            5 => {
                let heaps = ctx.memory_budget().heaps;
                let _counts =
                    (ctx.shader_cache_stats(), ctx.pipeline_cache_loaded_bytes(), ctx.shading_rates());
                if heaps.is_empty() || ctx.frames_in_flight() == 0 {
                    return Err("the context has no memory or no frames".to_owned());
                }
            }
            6 => {
                judge(ctx.index_faults(), &[Problem::Usage])?;
            }
            _ => {
                let live = ctx.live_objects().iter().filter(|found| found.name == "random buffer").count();
                let own = self.buffers.iter().filter(|buffer| buffer.holder.is_some()).count();
                if live < own {
                    return Err(format!("{live} buffers are listed, the program has {own}"));
                }
            }
        }
        self.record_problems(&[]);
        Ok(true)
    }

    /// Asks which buffers have a byte.
    fn ask_for_buffer(&mut self, n: [u16; 6]) -> Outcome {
        let Some(buffer) = self.pick_buffer(n[1]) else { return Ok(false) };
        let problems: Vec<_> = buffer.problem.into_iter().collect();
        self.record_problems(&problems);
        let Some(address) = judge(self.ctx().buffer_address(buffer.handle), &problems)? else {
            return Ok(true);
        };
        let found = self.ctx().buffers_at(&(address..address + 1));
        if found.len() == 1 && found[0].name == "random buffer" {
            return Ok(true);
        }
        Err(format!("the first byte of a buffer belongs to {found:?}"))
    }

    /// Asks for the Vulkan objects behind handles.
    pub(super) fn ask_raw(&mut self, n: [u16; 6]) -> Outcome {
        let ctx = self.ctx();
        let only = |problem: Option<Problem>| problem.into_iter().collect::<Vec<_>>();
        let (problems, found) = match n[0] % 5 {
            0 => {
                let Some(buffer) = self.pick_buffer(n[1]) else { return Ok(false) };
                let problems = only(buffer.problem);
                let found = judge(ctx.raw_buffer(buffer.handle), &problems)?;
                (problems, found.map(|raw| usize::from(raw != Default::default())))
            }
            1 => {
                let Some(texture) = self.pick_texture(n[1]) else { return Ok(false) };
                let problems = only(texture.problem);
                judge(ctx.raw_image(texture.handle), &problems)?;
                let info = self.info(&texture).copied();
                let lacks =
                    |usage| info.is_some_and(|info| !info.usage.contains(usage)).then_some(Problem::Usage);
                let sampled = [&problems[..], &only(lacks(TextureUsage::SAMPLED))].concat();
                judge(ctx.raw_image_view(texture.handle), &sampled)?;
                let (mip, layer) = (u32::from(n[2] % 3), u32::from(n[3] % 3));
                let exists = info.is_none_or(|info| mip < info.part.mips && layer < info.part.layers);
                let mut drawn = [&problems[..], &only(lacks(TextureUsage::TARGET))].concat();
                drawn.extend((!exists).then_some(Problem::Usage));
                judge(ctx.raw_target_view(texture.handle, mip, layer), &drawn)?;
                (drawn, None)
            }
            2 => {
                let Some(sampler) = self.samplers.last() else { return Ok(false) };
                (Vec::new(), judge(ctx.raw_sampler(sampler.handle), &[])?.map(|_| 1))
            }
            3 => {
                let Some(blas) = self.pick_blas(n[1]) else { return Ok(false) };
                let problems = only(blas.problem);
                let count = usize::from(builds_device_accel_structs(ctx));
                let addresses = judge(ctx.accel_struct_addresses(blas.handle), &problems)?;
                let raw = judge(ctx.raw_accel_structs(blas.handle), &problems)?;
                if addresses.is_some_and(|found| found.len() != count) {
                    return Err(format!("a BLAS has not {count} addresses"));
                }
                (problems, raw.map(|raw| usize::from(raw.len() == count)))
            }
            _ => {
                let Some(rays) = self.pick_rays(n[1]) else { return Ok(false) };
                let problems = only(rays.problem);
                (problems.clone(), judge(ctx.ray_tracing_stack_bytes(rays.handle), &problems)?.map(|_| 1))
            }
        };
        self.record_problems(&problems);
        if found == Some(0) { Err("an object is not there".to_owned()) } else { Ok(true) }
    }
}
