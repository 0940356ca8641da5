//! The Vulkan swapchain, and the synchronisation objects that present its images.

use std::sync::Arc;

use ash::vk;

use super::desc::{ColorSpace, HdrMetadata, PresentMode};
use super::failure::Failure;
use super::lifecycle::Acquired;
use super::present_wait::PRESENT_TIMEOUT_NS;
use super::surface::Surface;
use crate::cpu_scope::cpu_scope;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::Gpu;
use crate::gpu::start::driver_workarounds::with_shared_loader_lock;

/// Creation parameters of a Vulkan swapchain.
#[derive(Debug, Clone)]
pub(crate) struct ChainPlan {
    pub(crate) extent: [u32; 2],
    pub(crate) format: Format,
    pub(crate) color_space: ColorSpace,
    /// Present modes. The first is the initial one; the swapchain can switch to the others.
    pub(crate) modes: Vec<PresentMode>,
    pub(crate) image_count: u32,
    pub(crate) usage: vk::ImageUsageFlags,
    pub(crate) transform: vk::SurfaceTransformFlagsKHR,
    pub(crate) alpha: vk::CompositeAlphaFlagsKHR,
}

/// A Vulkan swapchain, destroyed on drop. The textures of its images keep it alive.
pub(crate) struct Chain {
    pub(crate) raw: vk::SwapchainKHR,
    surface: Arc<Surface>,
}

impl Chain {
    /// Creates a swapchain that replaces `old`. Even on failure, `old` can then only present images acquired from it.
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
        // SAFETY: the surface supports the plan's parameters; the old swapchain is of the same surface and locked.
        let raw = with_shared_loader_lock(|| unsafe { functions.swapchain.create_swapchain(&info, None) })
            .map_err(Failure::from_result("vkCreateSwapchainKHR", name))?;
        gpu.name(raw, name);
        Ok(Self { raw, surface: Arc::clone(surface) })
    }

    /// Returns the images, which the swapchain owns.
    pub(crate) fn images(&self) -> Result<Vec<vk::Image>, Failure> {
        let functions = &self.gpu().window_functions()?.swapchain;
        // SAFETY: the swapchain is alive.
        unsafe { functions.get_swapchain_images(self.raw) }
            .map_err(Failure::from_result("vkGetSwapchainImagesKHR", &self.surface.name))
    }

    /// Sets the HDR metadata of the images (`vkSetHdrMetadataEXT`), if the device supports it.
    pub(crate) fn set_hdr(&self, hdr: &HdrMetadata) -> Result<(), Failure> {
        if let Some(functions) = &self.gpu().window_functions()?.hdr {
            // SAFETY: the swapchain is alive and locked.
            unsafe { functions.set_hdr_metadata(&[self.raw], &[hdr.raw()]) };
        }
        Ok(())
    }

    /// Acquires the next image. The presentation engine signals `semaphore` when it has released the image.
    pub(crate) fn acquire(&self, semaphore: vk::Semaphore) -> Result<Acquired, Failure> {
        cpu_scope!("vkAcquireNextImageKHR");
        let functions = &self.gpu().window_functions()?.swapchain;
        // SAFETY: the swapchain is alive and locked, no other image of it is acquired, and nothing else uses the
        // semaphore.
        let answer = unsafe {
            functions.acquire_next_image(self.raw, PRESENT_TIMEOUT_NS, semaphore, vk::Fence::null())
        };
        match answer {
            Ok((index, suboptimal)) => Ok(Acquired::Image { index, suboptimal }),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Acquired::NotYet),
            Err(result) => Err(Failure::from_result("vkAcquireNextImageKHR", &self.surface.name)(result)),
        }
    }

    /// Presents an image. The presentation engine waits for the image's [`PresentSync`]. Returns true if the swapchain
    /// is suboptimal.
    pub(crate) fn present(&self, index: u32, mode: PresentMode, sync: &PresentSync) -> Result<bool, Failure> {
        cpu_scope!("vkQueuePresentKHR");
        let gpu = self.gpu();
        let functions = gpu.window_functions()?;
        let (chains, indices, waits) = ([self.raw], [index], [sync.drawn]);
        let (modes, fences) = ([mode.raw()], [sync.present_fence.unwrap_or_default()]);
        let mut mode = vk::SwapchainPresentModeInfoEXT::default().present_modes(&modes);
        let mut fence = vk::SwapchainPresentFenceInfoEXT::default().fences(&fences);
        let mut info =
            vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        if sync.present_fence.is_some() {
            info = info.push_next(&mut mode).push_next(&mut fence);
        }
        let queue = gpu.graphics_queue();
        // SAFETY: the image was acquired, a submission that signals the semaphore is pending, the fence is not in use,
        // and swapchain and queue are locked.
        unsafe { functions.swapchain.queue_present(*queue, &info) }
            .map_err(Failure::from_result("vkQueuePresentKHR", &self.surface.name))
    }

    fn gpu(&self) -> &Arc<Gpu> {
        &self.surface.gpu
    }
}

impl Drop for Chain {
    fn drop(&mut self) {
        if let Ok(functions) = self.gpu().window_functions() {
            // SAFETY: textures and command buffers that use its images are destroyed, and its presents are finished.
            unsafe { functions.swapchain.destroy_swapchain(self.raw, None) };
        }
    }
}

/// Synchronisation objects of one image's presents, destroyed on drop.
pub(crate) struct PresentSync {
    /// Signalled by the submission before the present. The presentation engine waits for it.
    pub(crate) drawn: vk::Semaphore,
    /// Signalled once a present no longer uses these objects, if the device supports present fences.
    present_fence: Option<vk::Fence>,
    /// True if the image was presented with these objects since its last acquisition.
    pub(crate) presented: bool,
    /// True if the image was acquired again, and no submission has waited for it since.
    pub(crate) came_back: bool,
    /// Timeline value of the last submission that signals `drawn`.
    pub(crate) drawn_at: u64,
    /// True if the presentation engine never finishes the image's presents, as far as the library can tell. For tests.
    #[cfg(any(test, feature = "test-hooks"))]
    pub(crate) stalls: bool,
    /// Debug name of the swapchain.
    name: Box<str>,
    gpu: Arc<Gpu>,
}

impl PresentSync {
    pub(crate) fn new(gpu: &Arc<Gpu>, name: &str) -> Result<Self> {
        let drawn = new_semaphore(gpu, name)?;
        let mut sync = Self {
            drawn,
            present_fence: None,
            presented: false,
            came_back: false,
            drawn_at: 0,
            #[cfg(any(test, feature = "test-hooks"))]
            stalls: false,
            name: name.into(),
            gpu: Arc::clone(gpu),
        };
        if gpu.window_functions()?.maintenance.is_some() {
            // SAFETY: no preconditions.
            let fence = unsafe { gpu.device.create_fence(&vk::FenceCreateInfo::default(), None) };
            sync.present_fence = Some(fence.map_err(Error::vulkan("vkCreateFence", name))?);
        }
        Ok(sync)
    }

    /// Resets the objects for the next present. The engine has released the image since the last one, so no wait is
    /// needed.
    pub(crate) fn reset(&self) -> Result<()> {
        let Some(fence) = self.present_fence.filter(|_| self.presented) else { return Ok(()) };
        if !self.wait(PRESENT_TIMEOUT_NS)? {
            return Err(Error::vulkan("vkWaitForFences", &self.name)(vk::Result::TIMEOUT));
        }
        // SAFETY: the fence is alive and no longer in use.
        unsafe { self.gpu.device.reset_fences(&[fence]) }.map_err(Error::vulkan("vkResetFences", &self.name))
    }

    /// True if the presentation engine may use the objects: without a fence, until a submission has waited for an image that came back.
    fn is_in_use(&self) -> bool {
        self.presented || self.came_back && self.present_fence.is_none()
    }

    /// True if the completion of the last present is known or can be queried.
    pub(crate) fn reports_completion(&self) -> bool {
        !self.is_in_use() || self.present_fence.is_some()
    }

    /// Returns true if nothing uses the objects when the timeline has reached `completed`; `None` if the device cannot
    /// tell.
    pub(crate) fn is_done(&self, completed: u64) -> Result<Option<bool>> {
        if !self.is_in_use() {
            // A present that failed leaves the semaphore to the submission before it.
            return Ok(Some(self.drawn_at <= completed));
        }
        let Some(fence) = self.present_fence else { return Ok(None) };
        // SAFETY: the fence is alive.
        let status = unsafe { self.gpu.device.get_fence_status(fence) };
        status.map(Some).map_err(Error::vulkan("vkGetFenceStatus", &self.name))
    }

    /// Waits at most `timeout_ns` nanoseconds until the presents are finished, if the device can tell. Returns true if
    /// they are finished.
    pub(crate) fn wait(&self, timeout_ns: u64) -> Result<bool> {
        let Some(fence) = self.present_fence.filter(|_| self.presented) else { return Ok(true) };
        // SAFETY: the fence is alive and belongs to a present.
        match unsafe { self.gpu.device.wait_for_fences(&[fence], true, timeout_ns) } {
            #[cfg(any(test, feature = "test-hooks"))]
            Ok(()) if self.stalls => Ok(false),
            Ok(()) => Ok(true),
            Err(vk::Result::TIMEOUT) => Ok(false),
            Err(result) => Err(Error::vulkan("vkWaitForFences", &self.name)(result)),
        }
    }
}

impl Drop for PresentSync {
    fn drop(&mut self) {
        // SAFETY: the owner has waited for the presents, or has given up those that do not end: a presentation engine that
        // never finishes them uses the semaphore no more.
        unsafe {
            self.gpu.device.destroy_semaphore(self.drawn, None);
            self.present_fence.into_iter().for_each(|fence| self.gpu.device.destroy_fence(fence, None));
        }
    }
}

/// Creates a binary semaphore.
pub(crate) fn new_semaphore(gpu: &Gpu, name: &str) -> Result<vk::Semaphore> {
    // SAFETY: no preconditions.
    let raw = unsafe { gpu.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .map_err(Error::vulkan("vkCreateSemaphore", name))?;
    gpu.name(raw, name);
    Ok(raw)
}
