//! Creation of the images of a transient heap, with the memory that they share.

use std::sync::Arc;

use ash::vk;

use super::image::Image;
use super::texture_desc::{TextureDesc, TextureMemory, TextureUsage};
use super::transient_heap::{
    SharedBlock, TransientHeapDesc, TransientHeapMemory, TransientMember, TransientPlace, TransientPlan,
    TransientTexture,
};
use super::transient_packing::{PackItem, Packing};
use crate::barrier::{ResourceId, Stages, Use};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::queue::Queue;

/// Creates the images of a heap with their memory. Returns them in the order of the description.
pub(crate) fn create_images(
    gpu: &Arc<Gpu>,
    desc: &TransientHeapDesc<'_>,
) -> Result<(Vec<Image>, Arc<TransientPlan>, TransientHeapMemory)> {
    check_heap(desc)?;
    let mut images = desc
        .textures
        .iter()
        .map(|texture| Image::without_memory(gpu, &texture.desc))
        .collect::<Result<Vec<_>>>()?;
    let mut memory = TransientHeapMemory::default();
    let mut sharers: Vec<Vec<usize>> = (0..images.len()).map(|index| vec![index]).collect();
    let mut groups: Vec<(u32, Vec<usize>)> = Vec::new();
    for (index, image) in images.iter_mut().enumerate() {
        let needs = image.memory_requirements();
        let texture = &desc.textures[index].desc;
        if texture.memory == TextureMemory::Transient && image.bind_lazy(texture.debug_name, needs)? {
            memory.lazy_bytes += needs.size;
            continue;
        }
        match groups.iter_mut().find(|(bits, _)| *bits == needs.memory_type_bits) {
            Some((_, group)) => group.push(index),
            None => groups.push((needs.memory_type_bits, vec![index])),
        }
    }
    for (memory_type_bits, group) in &groups {
        bind_group(gpu, desc, *memory_type_bits, group, &mut images, &mut sharers, &mut memory)?;
    }
    let plan = Arc::new(TransientPlan {
        name: desc.debug_name.to_owned(),
        queue: desc.queue,
        members: desc.textures.iter().zip(&images).zip(sharers).map(new_member).collect(),
    });
    for (member, image) in images.iter_mut().enumerate() {
        image.transient_place = Some(TransientPlace { plan: Arc::clone(&plan), member });
    }
    Ok((images, plan, memory))
}

/// Binds the images of a group, which have the same memory types, to one block.
fn bind_group(
    gpu: &Arc<Gpu>,
    desc: &TransientHeapDesc<'_>,
    memory_type_bits: u32,
    group: &[usize],
    images: &mut [Image],
    sharers: &mut [Vec<usize>],
    memory: &mut TransientHeapMemory,
) -> Result<()> {
    let pack_item = |&index: &usize| {
        let needs = images[index].memory_requirements();
        let TransientTexture { first_step, last_step, .. } = desc.textures[index];
        PackItem { bytes: needs.size, alignment: needs.alignment, steps: [first_step, last_step] }
    };
    let items: Vec<_> = group.iter().map(pack_item).collect();
    let packing = Packing::new(&items);
    let alignment = items.iter().map(|item| item.alignment).max().unwrap_or(1);
    let needs = vk::MemoryRequirements { size: packing.bytes, alignment, memory_type_bits };
    let block = SharedBlock::new(gpu, desc.debug_name, needs)?;
    for (&index, offset) in group.iter().zip(&packing.offsets) {
        images[index].bind_shared(&block, *offset, desc.textures[index].desc.debug_name)?;
    }
    for (&index, near) in group.iter().zip(packing.sharers(&items)) {
        sharers[index] = near.into_iter().map(|position| group[position]).collect();
    }
    memory.shared_bytes += packing.bytes;
    memory.separate_bytes += items.iter().map(|item| item.bytes).sum::<u64>();
    Ok(())
}

fn new_member(((texture, image), sharers): ((&TransientTexture<'_>, &Image), Vec<usize>)) -> TransientMember {
    TransientMember {
        image: image.id,
        shape: image.shape,
        bytes: ResourceId::next(),
        steps: [texture.first_step, texture.last_step],
        sharers,
        first_use: first_use(&texture.desc),
    }
}

/// Returns every use that may be the first of a texture: all stages that can write it, or change its layout.
fn first_use(desc: &TextureDesc<'_>) -> Use {
    let mut stages = Stages::empty();
    if desc.memory == TextureMemory::Device {
        stages |= Stages::TRANSFER;
    }
    if desc.usage.contains(TextureUsage::TARGET) {
        stages |= if desc.format.is_color() { Stages::COLOR } else { Stages::DEPTH | Stages::COLOR };
    }
    if desc.usage.contains(TextureUsage::INPUT) {
        stages |= Stages::FRAGMENT;
    }
    if desc.usage.contains(TextureUsage::STORAGE) {
        stages |= Stages::SHADERS;
    }
    Use::any_of(stages)
}

/// Fails unless each texture can be in a heap.
fn check_heap(desc: &TransientHeapDesc<'_>) -> Result<()> {
    if desc.textures.is_empty() {
        return Err(Error::usage(desc.debug_name, "a transient heap needs at least one texture"));
    }
    let in_passes = |texture: &&TransientTexture<'_>| texture.desc.memory == TextureMemory::Transient;
    if let Some(texture) = desc.textures.iter().find(in_passes)
        && desc.queue != Queue::Graphics
    {
        let message =
            "only passes use a texture with TextureMemory::Transient, and passes need the graphics queue";
        return Err(Error::usage(texture.desc.debug_name, message));
    }
    desc.textures.iter().try_for_each(check_texture)
}

fn check_texture(texture: &TransientTexture<'_>) -> Result<()> {
    let TransientTexture { desc, first_step, last_step } = texture;
    let wrong = |message: String| Err(Error::usage(desc.debug_name, message));
    if first_step > last_step {
        return wrong(format!(
            "its first step is {first_step}, its last step is {last_step}; the last is not before the first"
        ));
    }
    if desc.data.is_some() || desc.generate_mips {
        return wrong(
            "a texture of a transient heap takes no data: its contents end with its last step".to_owned(),
        );
    }
    if desc.format.is_yuv() {
        return wrong(format!(
            "{:?} cannot be in a transient heap; create the texture on its own",
            desc.format
        ));
    }
    Ok(())
}
