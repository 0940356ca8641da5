//! The Vulkan swapchain, and what each of its images is presented with.

use std::sync::Arc;

use ash::vk;

use super::choose::Failure;
use super::desc::{ColorSpace, HdrMetadata, PresentMode};
use super::lifecycle::Acquired;
use super::present_wait::PRESENT_TIMEOUT_NS;
use super::surface::Surface;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;

/// Everything a Vulkan swapchain is made of.
#[derive(Debug, Clone)]
pub(crate) struct ChainPlan {
    pub(crate) extent: [u32; 2],
    pub(crate) format: Format,
    pub(crate) color_space: ColorSpace,
    /// The first is that of the start; it can change to the others.
    pub(crate) modes: Vec<PresentMode>,
    pub(crate) image_count: u32,
    pub(crate) usage: vk::ImageUsageFlags,
    pub(crate) transform: vk::SurfaceTransformFlagsKHR,
    pub(crate) alpha: vk::CompositeAlphaFlagsKHR,
}

/// A Vulkan swapchain, destroyed on drop. The textures of its images keep it.
pub(crate) struct Chain {
    pub(crate) raw: vk::SwapchainKHR,
    surface: Arc<Surface>,
}

impl Chain {
    /// A new swapchain in place of `old`, which can then only present what was taken from it, also where this fails.
    pub(crate) fn new(
        surface: &Arc<Surface>,
        plan: &ChainPlan,
        old: Option<&Self>,
        name: &str,
    ) -> Result<Self, Failure> {
        let gpu = &surface.gpu;
        let functions = gpu.window_functions()?;
        let [width, height] = plan.extent;
        let modes: Vec<_> = plan.modes.iter().map(|mode| mode.raw()).collect();
        let mut changing = vk::SwapchainPresentModesCreateInfoEXT::default().present_modes(&modes);
        let mut info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count(plan.image_count)
            .image_format(plan.format.raw())
            .image_color_space(plan.color_space.raw())
            .image_extent(vk::Extent2D { width, height })
            .image_array_layers(1)
            .image_usage(plan.usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(plan.transform)
            .composite_alpha(plan.alpha)
            .present_mode(modes.first().copied().unwrap_or(vk::PresentModeKHR::FIFO))
            .clipped(true)
            .old_swapchain(old.map_or(vk::SwapchainKHR::null(), |old| old.raw));
        if functions.maintenance.is_some() {
            info = info.push_next(&mut changing);
        }
        // SAFETY: the plan is made from what the surface says it takes; the old swapchain is of the same surface and locked.
        let raw = unsafe { functions.swapchain.create_swapchain(&info, None) }
            .map_err(Failure::from_result("vkCreateSwapchainKHR"))?;
        gpu.name(raw, name);
        Ok(Self { raw, surface: Arc::clone(surface) })
    }

    /// Its images, which it owns.
    pub(crate) fn images(&self) -> Result<Vec<vk::Image>, Failure> {
        let functions = &self.gpu().window_functions()?.swapchain;
        // SAFETY: the swapchain is alive.
        unsafe { functions.get_swapchain_images(self.raw) }
            .map_err(Failure::from_result("vkGetSwapchainImagesKHR"))
    }

    /// Tells the display what the pictures are like, where it can be told.
    pub(crate) fn set_hdr(&self, hdr: &HdrMetadata) -> Result<(), Failure> {
        if let Some(functions) = &self.gpu().window_functions()?.hdr {
            // SAFETY: the swapchain is alive and locked.
            unsafe { functions.set_hdr_metadata(&[self.raw], &[hdr.raw()]) };
        }
        Ok(())
    }

    /// Takes the next image, and signals `semaphore` when the engine has let go of it.
    pub(crate) fn acquire(&self, semaphore: vk::Semaphore) -> Result<Acquired, Failure> {
        let functions = &self.gpu().window_functions()?.swapchain;
        // SAFETY: the swapchain is alive and locked, no other image of it is taken, and nothing else uses the semaphore.
        let answer = unsafe {
            functions.acquire_next_image(self.raw, PRESENT_TIMEOUT_NS, semaphore, vk::Fence::null())
        };
        match answer {
            Ok((index, suboptimal)) => Ok(Acquired::Image { index, suboptimal }),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::NotYet),
            Err(result) => Err(Failure::from_result("vkAcquireNextImageKHR")(result)),
        }
    }

    /// Hands an image to the engine, which waits for its [`PresentSync`]. Answers whether the swapchain could be better.
    pub(crate) fn present(&self, index: u32, mode: PresentMode, sync: &PresentSync) -> Result<bool, Failure> {
        let gpu = self.gpu();
        let functions = gpu.window_functions()?;
        let (chains, indices, waits) = ([self.raw], [index], [sync.drawn]);
        let (modes, fences) = ([mode.raw()], [sync.shown.unwrap_or_default()]);
        let mut mode = vk::SwapchainPresentModeInfoEXT::default().present_modes(&modes);
        let mut fence = vk::SwapchainPresentFenceInfoEXT::default().fences(&fences);
        let mut info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        if sync.shown.is_some() {
            info = info.push_next(&mut mode).push_next(&mut fence);
        }
        let queue = gpu.graphics_queue();
        // SAFETY: the image was acquired, a submission that signals the semaphore is on its way, the fence is not in use,
        // and swapchain and queue are locked.
        unsafe { functions.swapchain.queue_present(*queue, &info) }
            .map_err(Failure::from_result("vkQueuePresentKHR"))
    }

    fn gpu(&self) -> &Arc<Gpu> {
        &self.surface.gpu
    }
}

impl Drop for Chain {
    fn drop(&mut self) {
        if let Ok(functions) = self.gpu().window_functions() {
            // SAFETY: textures and command buffers that use its images are gone, and so are its presents.
            unsafe { functions.swapchain.destroy_swapchain(self.raw, None) };
        }
    }
}

/// What one image is presented with, destroyed on drop.
pub(crate) struct PresentSync {
    /// Signalled by the submission that presents the image, waited for by the engine.
    pub(crate) drawn: vk::Semaphore,
    /// Signalled once a present needs nothing of this any more, where the device can.
    shown: Option<vk::Fence>,
    /// Whether it was presented since it was made.
    pub(crate) presented: bool,
    /// Whether the engine never ends its presents, as far as the library is told.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) stalls: bool,
    gpu: Arc<Gpu>,
}

impl PresentSync {
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &str) -> Result<Self> {
        let drawn = new_semaphore(gpu, name)?;
        let mut sync = Self {
            drawn,
            shown: None,
            presented: false,
            #[cfg(any(test, feature = "test-hooks"))]
            stalls: false,
            gpu: Arc::clone(gpu),
        };
        if gpu.window_functions()?.maintenance.is_some() {
            // SAFETY: no preconditions.
            let fence = unsafe { gpu.device.create_fence(&vk::FenceCreateInfo::default(), None) };
            sync.shown = Some(fence.map_err(Error::vulkan("vkCreateFence"))?);
        }
        Ok(sync)
    }

    /// Readies it for the next present. The engine has given the image back since the last one, so nothing is waited for.
    pub(crate) fn reset(&self) -> Result<()> {
        let Some(fence) = self.shown.filter(|_| self.presented) else { return Ok(()) };
        if !self.wait(PRESENT_TIMEOUT_NS)? {
            return Err(Error::vulkan("vkWaitForFences")(vk::Result::TIMEOUT));
        }
        // SAFETY: the fence is alive and no longer in use.
        unsafe { self.gpu.device.reset_fences(&[fence]) }.map_err(Error::vulkan("vkResetFences"))
    }

    /// Whether its presents are over; `None` where nobody can tell.
    pub(crate) fn is_done(&self) -> Option<bool> {
        if !self.presented {
            return Some(true);
        }
        // SAFETY: the fence is alive. A lost device has no presents.
        self.shown.map(|fence| unsafe { self.gpu.device.get_fence_status(fence) }.unwrap_or(true))
    }

    /// Waits until its presents are over, where the device can tell, so many nanoseconds at most. Answers whether they are.
    pub(crate) fn wait(&self, timeout_ns: u64) -> Result<bool> {
        let Some(fence) = self.shown.filter(|_| self.presented) else { return Ok(true) };
        // SAFETY: the fence is alive and belongs to a present.
        match unsafe { self.gpu.device.wait_for_fences(&[fence], true, timeout_ns) } {
            #[cfg(any(test, feature = "test-hooks"))]
            Ok(()) if self.stalls => Ok(false),
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => Err(Error::vulkan("vkWaitForFences")(result)),
        }
    }
}

impl Drop for PresentSync {
    fn drop(&mut self) {
        // SAFETY: the owner has waited for the presents.
        unsafe {
            self.gpu.device.destroy_semaphore(self.drawn, None);
            self.shown.into_iter().for_each(|fence| self.gpu.device.destroy_fence(fence, None));
        }
    }
}

/// A binary semaphore.
pub(crate) fn new_semaphore(gpu: &Gpu, name: &str) -> Result<vk::Semaphore> {
    // SAFETY: no preconditions.
    let raw = unsafe { gpu.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .map_err(Error::vulkan("vkCreateSemaphore"))?;
    gpu.name(raw, name);
    Ok(raw)
}
