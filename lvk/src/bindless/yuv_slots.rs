//! Slots of Y'CbCr textures: one binding with a range for each conversion. The samplers of the conversions are part of
//! the layout.

use std::sync::Arc;

use ash::vk;

use super::layout::DescriptorCounts;
use super::slot_array::SlotArray;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::descriptor_limits::YuvRequest;
use crate::resource::ycbcr::{YuvConversion, YuvSampler};

/// Conversions of a context with the slots of their textures.
pub(crate) struct YuvSlots {
    ranges: Vec<ConversionRange>,
    /// Slots of each supported conversion, including its default descriptor.
    room: u32,
    /// Descriptors of all slots. Each slot takes as many as the conversion with the largest need.
    descriptors: u32,
}

struct ConversionRange {
    desc: YuvConversion,
    /// The conversion, or the feature that the device lacks for it.
    sampler: Result<Arc<YuvSampler>, &'static str>,
    /// First slot in the binding.
    first: u32,
    textures: SlotArray<vk::ImageView>,
    default_view: Option<vk::ImageView>,
}

/// The slot of a texture and its conversion.
pub(crate) struct YuvSlot {
    pub(crate) slot: u32,
    pub(crate) conversion: vk::SamplerYcbcrConversion,
}

impl YuvSlots {
    const MAX_TEXTURES: u32 = 1_024;

    /// Creates the supported conversions, each with slots for `textures` textures or as many as the device allows.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] if the device does not allow one texture for each conversion.
    pub(crate) fn new(gpu: &Arc<Gpu>, descs: &[YuvConversion], textures: u32) -> Result<Self> {
        let mut samplers = Vec::with_capacity(descs.len());
        for desc in descs {
            samplers.push((*desc, YuvSampler::new(gpu, desc)?.map(Arc::new)));
        }
        let made = || samplers.iter().filter_map(|(_, sampler)| sampler.as_ref().ok());
        let wish = YuvRequest {
            conversions: made().count() as u32,
            textures: textures.min(Self::MAX_TEXTURES) + 1,
            descriptors: made().map(|sampler| sampler.descriptors).max().unwrap_or(1),
        };
        let room = gpu.descriptor_limits().yuv_textures(&DescriptorCounts::new(gpu).reserved, &wish)?;
        let (mut ranges, mut first) = (Vec::with_capacity(descs.len()), 0);
        for (desc, sampler) in samplers {
            let own = if sampler.is_ok() { room } else { 0 };
            let textures = SlotArray::new("number of textures of a conversion", own);
            ranges.push(ConversionRange { desc, sampler, first, textures, default_view: None });
            first += own;
        }
        Ok(Self { ranges, room, descriptors: wish.descriptors * first })
    }

    /// Returns the immutable samplers of the binding, one for each slot.
    pub(super) fn samplers(&self) -> Vec<vk::Sampler> {
        let made = self.ranges.iter().filter_map(|range| range.sampler.as_ref().ok());
        made.flat_map(|made| std::iter::repeat_n(made.sampler, self.room as usize)).collect()
    }

    /// Returns the number of descriptors that the slots take in the set, in a stage and in a pool.
    pub(super) fn descriptors(&self) -> u32 {
        self.descriptors
    }

    /// Returns the conversions that need a default descriptor, with their numbers.
    pub(crate) fn conversions(&self) -> Vec<(usize, YuvConversion, vk::SamplerYcbcrConversion)> {
        let made = |(number, range): (usize, &ConversionRange)| {
            let sampler = range.sampler.as_ref().ok()?;
            Some((number, range.desc, sampler.conversion))
        };
        self.ranges.iter().enumerate().filter_map(made).collect()
    }

    /// Reserves a slot for a texture of `format`. A `conversion` of `None` selects the first of the format.
    pub(super) fn reserve(
        &mut self,
        format: crate::Format,
        conversion: Option<usize>,
        name: &str,
    ) -> Result<YuvSlot> {
        let first = self.ranges.iter().position(|range| range.desc.format == format);
        let chosen = conversion.or(first).and_then(|number| self.ranges.get_mut(number));
        let Some(range) = chosen.filter(|range| range.desc.format == format) else {
            let message =
                format!("list a conversion of {format:?} in ContextDesc::yuv, and name it by its number");
            return Err(Error::usage(name, message));
        };
        let sampler = range.sampler.as_ref().map_err(|lack| {
            Error::unsupported(format!("texture '{name}' converted by {:?}", range.desc), *lack)
        })?;
        let conversion = sampler.conversion;
        let slot = range.first + range.textures.reserve(name)?;
        Ok(YuvSlot { slot, conversion })
    }

    pub(super) fn set(&mut self, slot: u32, view: vk::ImageView) {
        if let Some((range, own)) = self.range(slot) {
            range.textures.set(own, Some(view));
        }
    }

    pub(super) fn free(&mut self, slot: u32) {
        if let Some((range, own)) = self.range(slot) {
            range.textures.set(own, None);
            range.textures.slots.free(own);
        }
    }

    pub(super) fn set_default(&mut self, conversion: usize, view: vk::ImageView) {
        if let Some(range) = self.ranges.get_mut(conversion) {
            range.default_view = Some(view);
        }
    }

    /// Returns all slots with their default views, in ascending order.
    pub(super) fn all_views(&self) -> Vec<(u32, vk::ImageView)> {
        let slots = |range: &ConversionRange| {
            let slots =
                range.default_view.map(|default_view| (range.first..range.first + self.room, default_view));
            slots
                .into_iter()
                .flat_map(|(slots, default_view)| slots.map(move |slot| (slot, default_view)))
                .collect::<Vec<_>>()
        };
        self.ranges.iter().flat_map(slots).collect()
    }

    /// True if no slot must be written.
    pub(super) fn is_clean(&self) -> bool {
        self.ranges.iter().all(|range| range.textures.slots.is_clean())
    }

    /// Returns the number of slots that are taken, without default descriptors.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(super) fn taken_count(&self) -> usize {
        self.ranges.iter().map(|range| range.textures.slots.taken_count()).sum()
    }

    /// Returns the slots to write with their views, in ascending order.
    pub(super) fn take_dirty(&mut self) -> Vec<(u32, vk::ImageView)> {
        let mut dirty = Vec::new();
        for range in &mut self.ranges {
            let (first, default_view) = (range.first, range.default_view);
            let own = range.textures.take_dirty();
            dirty.extend(
                own.into_iter().filter_map(|(slot, view)| Some((first + slot, view.or(default_view)?))),
            );
        }
        dirty
    }

    fn range(&mut self, slot: u32) -> Option<(&mut ConversionRange, u32)> {
        let range = self
            .ranges
            .iter_mut()
            .filter(|range| range.sampler.is_ok())
            .rfind(|range| range.first <= slot)?;
        let own = slot - range.first;
        Some((range, own))
    }
}
