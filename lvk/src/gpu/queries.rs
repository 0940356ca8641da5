//! Queries to a device: formats, images, shading rates, memory, and the fault of a lost device.

use ash::vk;

use super::answers::image_support;
use super::caps::format_features::format_properties;
use super::caps::host_image_copy::host_copies_stay_optimal;
use super::caps::optional_features::OptionalFeature;
use super::caps::shading_rate::{ShadingRate, ShadingRateCombiner, ShadingRateError, check_rate};
use super::checkpoints::PassedCheckpoints;
use super::debug::device_fault::query_fault;
use super::device::Gpu;
use super::memory::budget::MemoryBudget;
use crate::error::device_fault::DeviceFault;
use crate::error::{Error, Result};
use crate::format::Format;

impl Gpu {
    /// Returns the features of images of `format` in optimal tiling. Empty if a feature that the format needs
    /// is disabled.
    pub(crate) fn format_features(&self, format: Format) -> vk::FormatFeatureFlags {
        self.format_answers.image_features(&self.instance.raw, self.physical(), &self.caps, format)
    }

    /// Returns the features of buffers of `format`.
    pub(crate) fn buffer_features(&self, format: vk::Format) -> vk::FormatFeatureFlags {
        format_properties(&self.instance.raw, self.physical(), format).buffer_features
    }

    /// Returns the limits of an image of this description. `name` is the object in the error. `None` if the driver does not support it.
    pub(crate) fn image_limits(
        &self,
        info: &vk::ImageCreateInfo<'_>,
        name: &str,
    ) -> Result<Option<vk::ImageFormatProperties>> {
        let limits = self.image_limits.image_limits(&self.instance.raw, self.physical(), info);
        image_support(limits, "vkGetPhysicalDeviceImageFormatProperties", name)
    }

    /// Returns the sample counts that a plain render target of `format` may have. Empty if the format cannot
    /// be a target. `name` is the object in the error.
    pub(crate) fn target_samples(
        &self,
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        name: &str,
    ) -> Result<vk::SampleCountFlags> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        Ok(self
            .image_limits(&info, name)?
            .map_or(vk::SampleCountFlags::empty(), |limits| limits.sample_counts))
    }

    /// True if the host can write images of this description without making sampling on the device slower. `name` is the object in
    /// the error.
    pub(crate) fn host_copies_stay_optimal(
        &self,
        info: &vk::ImageCreateInfo<'_>,
        name: &str,
    ) -> Result<bool> {
        host_copies_stay_optimal(&self.instance.raw, self.physical(), info, name)
    }

    /// Returns an error unless the device has the rate with `samples` samples per pixel. `name` is the object
    /// in the error.
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

    /// Returns sizes, budgets and uses of the memory heaps.
    pub(crate) fn memory_budget(&self) -> MemoryBudget {
        let is_measured = self.caps.has(OptionalFeature::MemoryBudget);
        self.heap_use.query_budget(&self.instance.raw, self.physical(), is_measured)
    }

    /// Returns the ticks of the device's clock at this moment; `None` where the device and the host share no clock. A failure goes to
    /// the `log` crate, as a profile that lacks it is no reason to fail a submission.
    #[cfg(feature = "tracy")]
    pub(crate) fn device_ticks(&self) -> Option<u64> {
        match self.clock_reader.as_ref()?.device_ticks() {
            Ok(ticks) => Some(ticks),
            Err(Error::Unsupported { .. }) => None,
            Err(error) => {
                log::warn!("Tracy gets no time of the GPU: {error}");
                None
            }
        }
    }

    /// Queries the fault of a lost device. `None` if the driver does not provide it.
    pub(crate) fn query_fault(&self) -> Option<DeviceFault> {
        query_fault(self.device_fault.as_ref()?, self.device.handle())
    }

    /// Returns the checkpoints that a queue of a lost device has passed. `None` if the context writes none, and for
    /// queues that share a Vulkan queue.
    pub(crate) fn passed_checkpoints(&self, queue_index: usize) -> Option<PassedCheckpoints> {
        let checkpoints = self.checkpoints.as_ref().filter(|_| !self.queues.is_emulated())?;
        Some(checkpoints.passed(*self.queues.raw(queue_index)))
    }
}
