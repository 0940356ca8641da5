//! Queries to a device: formats, images, shading rates, memory, and its fault where it is lost.

use std::sync::Arc;

use ash::vk;

use super::caps::format_features::format_properties;
use super::caps::host_image_copy::host_copies_stay_optimal;
use super::caps::image_limits::ImageLimitsResult;
use super::caps::optional_features::OptionalFeature;
use super::caps::shading_rate::{ShadingRate, ShadingRateCombiner, ShadingRateError, check_rate};
use super::debug::device_fault::query_fault;
use super::device::Gpu;
use super::memory::budget::MemoryBudget;
use crate::error::{Error, Result};
use crate::format::Format;

impl Gpu {
    /// Features of images of `format` in optimal tiling; none where a feature that the format needs is off.
    pub(crate) fn format_features(&self, format: Format) -> vk::FormatFeatureFlags {
        self.format_answers.image_features(&self.instance.raw, self.physical(), &self.caps, format)
    }

    /// Features of buffers of `format`.
    pub(crate) fn buffer_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        format_properties(&self.instance.raw, self.physical(), format).buffer_features
    }

    /// Limits of an image of this description, or the driver's refusal.
    pub(crate) fn image_limits(&self, info: &vk::ImageCreateInfo<'_>) -> ImageLimitsResult {
        self.image_limits.image_limits(&self.instance.raw, self.physical(), info)
    }

    /// How many samples a pixel a plain target of `format` may have; none where it cannot be a target.
    pub(crate) fn target_samples(
        &self,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
    ) -> vk::SampleCountFlags {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        self.image_limits(&info).map_or(vk::SampleCountFlags::empty(), |limits| limits.sample_counts)
    }

    /// True if the host can write images of this description, and the device samples them as fast as others.
    pub(crate) fn host_copies_stay_optimal(&self, info: &vk::ImageCreateInfo<'_>) -> bool {
        host_copies_stay_optimal(&self.instance.raw, self.physical(), info)
    }

    /// Fails unless the device has the rate with so many samples a pixel; `name` is refused.
    pub(crate) fn check_shading_rate(&self, name: &str, rate: &ShadingRate, samples: u32) -> Result<()> {
        let what = format!("the shading rate {:?} of '{name}'", rate.size);
        self.require(OptionalFeature::PipelineShadingRate, &what)?;
        if rate.primitive != ShadingRateCombiner::Keep {
            self.require(OptionalFeature::PrimitiveShadingRate, &format!("primitives in {what}"))?;
        }
        if rate.attachment != ShadingRateCombiner::Keep {
            self.require(OptionalFeature::AttachmentShadingRate, &format!("the attachment in {what}"))?;
        }
        let sizes = self.shading_rates.as_ref().map_or(&[][..], |rates| &rates.sizes);
        match check_rate(rate, samples, sizes, self.caps.limits.shading_rate.combines) {
            Ok(()) => Ok(()),
            Err(ShadingRateError::Wrong(message)) => Err(Error::usage(name, message)),
            Err(ShadingRateError::Lacks(why)) => {
                Err(Error::unsupported(what, format!("the device '{}': {why}", self.caps.device_name)))
            }
        }
    }

    /// Sizes, budgets and uses of the heaps of memory.
    pub(crate) fn memory_budget(&self) -> MemoryBudget {
        let is_measured = self.caps.has(OptionalFeature::MemoryBudget);
        self.heap_use.query_budget(&self.instance.raw, self.physical(), is_measured)
    }

    /// As [`Error::vulkan`], with what the device says of its fault where it is lost.
    pub(crate) fn vulkan_error(&self, call: &'static str) -> impl FnOnce(vk::Result) -> Error + '_ {
        move |result| match result {
            vk::Result::ERROR_DEVICE_LOST => {
                let functions = self.device_fault.as_ref();
                let fault = functions.and_then(|functions| query_fault(functions, self.device.handle()));
                Error::DeviceLost { call, fault: fault.map(Arc::new) }
            }
            other => Error::vulkan(call)(other),
        }
    }
}
