//! A swapchain with all of its state that changes from frame to frame.

use std::sync::{Arc, Weak};

use ash::vk;

use super::chain::{Chain, ChainPlan, PresentSync, new_semaphore};
use super::desc::{ColorSpace, HdrMetadata, PresentMode};
use super::lifecycle::SwapchainState;
use super::present_wait::{ask_until_finished, wait_for_all};
use super::surface::Surface;
use crate::barrier::ResourceId;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::start::window::{WindowHandles, is_same_window};
use crate::handle::TextureHandle;
use crate::lock_order::{Guard, Mutex, Rank};
use crate::resource::Texture;
use crate::resource::texture_desc::TextureUsage;

/// The caller's configuration, for every Vulkan swapchain created for this swapchain.
#[derive(Debug, Clone)]
pub(crate) struct SwapchainConfig {
    pub(crate) extent: [u32; 2],
    pub(crate) present_modes: Vec<PresentMode>,
    pub(crate) color_spaces: Vec<ColorSpace>,
    pub(crate) hdr: Option<HdrMetadata>,
    pub(crate) usage: TextureUsage,
    pub(crate) image_count: u32,
}

/// A swapchain.
pub(crate) struct Swapchain {
    pub(crate) name: Arc<str>,
    state: Mutex<SwapchainInner>,
}

/// State under the lock of the swapchain.
pub(crate) struct SwapchainInner {
    pub(crate) lifecycle: SwapchainState,
    pub(crate) resources: SwapchainResources,
}

/// Resources that the lifecycle manages.
pub(crate) struct SwapchainResources {
    name: Arc<str>,
    pub(crate) config: SwapchainConfig,
    pub(crate) window: Arc<dyn WindowHandles>,
    /// `None` while the swapchain is suspended, and after a surface was lost and no other could be created.
    pub(crate) surface: Option<Arc<Surface>>,
    /// Surfaces that were released. Each lives as long as command buffers or views keep its images.
    pub(crate) released: Vec<Weak<Surface>>,
    /// `None` without images, for example for a minimised window.
    pub(crate) current: Option<Current>,
    /// Acquire semaphores, each with the timeline value from which on it is free.
    semaphores: Vec<(vk::Semaphore, u64)>,
    /// The semaphore that is signalled for the acquired image.
    pub(crate) signalled: Option<vk::Semaphore>,
    retired: Vec<RetiredChain>,
    pub(crate) rebuilds: u64,
    pub(crate) gpu: Arc<Gpu>,
}

/// The Vulkan swapchain in use.
pub(crate) struct Current {
    pub(crate) images: Vec<ChainImage>,
    pub(crate) plan: ChainPlan,
    pub(crate) mode: PresentMode,
    pub(crate) offered_modes: Vec<PresentMode>,
    /// Dropped after its images.
    pub(crate) chain: Arc<Chain>,
}

/// An image of the Vulkan swapchain.
pub(crate) struct ChainImage {
    pub(crate) texture: TextureHandle,
    pub(crate) object: Arc<Texture>,
    pub(crate) sync: PresentSync,
}

/// A replaced Vulkan swapchain, kept until its presents are finished.
struct RetiredChain {
    syncs: Vec<PresentSync>,
    /// Timeline value at which its presents are finished, if the device has no present fences.
    over_at: Option<u64>,
    _chain: Arc<Chain>,
}

impl Swapchain {
    pub(crate) fn new(name: &str, surface: Surface, config: SwapchainConfig, gpu: &Arc<Gpu>) -> Self {
        let name: Arc<str> = Arc::from(name);
        let resources = SwapchainResources {
            name: Arc::clone(&name),
            config,
            window: Arc::clone(&surface.window),
            surface: Some(Arc::new(surface)),
            released: Vec::new(),
            current: None,
            semaphores: Vec::new(),
            signalled: None,
            retired: Vec::new(),
            rebuilds: 0,
            gpu: Arc::clone(gpu),
        };
        let state =
            Mutex::new(Rank::Swapchain, SwapchainInner { lifecycle: SwapchainState::new(), resources });
        Self { name, state }
    }

    pub(crate) fn lock(&self) -> Guard<'_, SwapchainInner> {
        self.state.lock()
    }
}

impl Current {
    /// Returns the resource ids of the images, in order.
    pub(crate) fn ids(&self) -> Vec<ResourceId> {
        self.images.iter().map(|image| image.object.image.id).collect()
    }
}

impl SwapchainResources {
    /// Returns an unused semaphore, when the timeline has reached `completed`.
    pub(crate) fn take_semaphore(&mut self, completed: u64, name: &str) -> Result<vk::Semaphore> {
        match self.semaphores.iter().position(|(_, free_at)| *free_at <= completed) {
            Some(place) => Ok(self.semaphores.swap_remove(place).0),
            None => new_semaphore(&self.gpu, name),
        }
    }

    /// Takes back a semaphore, which is free when the timeline reaches `free_at`.
    pub(crate) fn recycle_semaphore(&mut self, semaphore: vk::Semaphore, free_at: u64) {
        self.semaphores.push((semaphore, free_at));
    }

    /// Keeps a replaced swapchain and its synchronisation objects until its presents are finished.
    pub(crate) fn retire(&mut self, chain: Arc<Chain>, syncs: Vec<PresentSync>) {
        self.retired.push(RetiredChain { syncs, over_at: None, _chain: chain });
    }

    /// Records that a presented image was acquired again, and that the submission of this value waits for it. Earlier
    /// presents of the queue are then finished.
    pub(crate) fn set_presents_done_at(&mut self, value: u64) {
        for retired in &mut self.retired {
            retired.over_at.get_or_insert(value);
        }
    }

    /// Destroys replaced swapchains whose presents are finished. On failure, the others are kept.
    pub(crate) fn destroy_finished(&mut self, completed: u64) -> Result<()> {
        let mut all = Ok(());
        self.retired.retain(|retired| match retired.is_done(completed) {
            Ok(done) => !done,
            Err(error) => {
                all = Err(error);
                true
            }
        });
        all
    }

    /// Waits until all presents are finished, but at most for the timeout.
    pub(crate) fn wait_for_presents(&self) -> Result<()> {
        let mut told = true;
        let given_up = wait_for_all(self.syncs(), |sync, timeout_ns| {
            told &= sync.reports_completion();
            sync.wait(timeout_ns)
        })?;
        if given_up > 0 {
            self.warn_of_abandoned(given_up);
        } else if told {
            return Ok(());
        }
        self.wait_for_queue()
    }

    /// Waits as [`wait_for_presents`](Self::wait_for_presents) does. If memory for the wait is short, asks the fences for
    /// about a second.
    fn wait_persistently(&self) -> Result<()> {
        match self.wait_for_presents() {
            Err(error) if error.lacks_memory() => {}
            ended => return ended,
        }
        let unfinished = ask_until_finished(|| self.count_unfinished(), std::thread::sleep)?;
        if unfinished > 0 {
            self.warn_of_abandoned(unfinished);
            self.wait_for_queue()?;
        }
        Ok(())
    }

    /// Returns the number of presents that are not finished.
    fn count_unfinished(&self) -> Result<usize> {
        let (mut unfinished, mut told) = (0, true);
        for sync in self.syncs() {
            match sync.is_done(u64::MAX)? {
                Some(done) => unfinished += usize::from(!done),
                None => told = false,
            }
        }
        if !told {
            self.wait_for_queue()?;
        }
        Ok(unfinished)
    }

    /// Returns the synchronisation objects of all presents.
    fn syncs(&self) -> impl Iterator<Item = &PresentSync> {
        let current = self.current.iter().flat_map(|current| &current.images).map(|image| &image.sync);
        current.chain(self.retired.iter().flat_map(|retired| &retired.syncs))
    }

    /// Waits for the queue that presents images.
    fn wait_for_queue(&self) -> Result<()> {
        let queue = self.gpu.graphics_queue();
        // SAFETY: the queue is locked.
        unsafe { self.gpu.device.queue_wait_idle(*queue) }
            .map_err(Error::vulkan("vkQueueWaitIdle", "graphics queue"))
    }

    fn warn_of_abandoned(&self, count: usize) {
        log::warn!(
            "{}: presents that do not end within the timeout are abandoned: {count}",
            readable_name(&*self.name)
        );
    }

    /// True if there is a surface, also one that was released and that something keeps.
    pub(crate) fn has_surface(&mut self) -> bool {
        self.surface.is_some() || self.is_released_surface_kept()
    }

    /// True if command buffers or views keep a surface that was released.
    pub(crate) fn is_released_surface_kept(&mut self) -> bool {
        self.released.retain(|surface| surface.strong_count() > 0);
        !self.released.is_empty()
    }

    /// True if command buffers or views keep a surface of the present window that was released.
    pub(crate) fn is_window_kept(&self) -> bool {
        let mut surfaces = self.released.iter().filter_map(Weak::upgrade);
        surfaces.any(|surface| is_same_window(surface.window.as_ref(), self.window.as_ref()))
    }

    /// Destroys all replaced swapchains, and the surface if nothing else keeps it. Their presents are finished or
    /// abandoned.
    pub(crate) fn release(&mut self) {
        self.retired.clear();
        self.released.extend(self.surface.take().as_ref().map(Arc::downgrade));
    }
}

impl RetiredChain {
    fn is_done(&self, completed: u64) -> Result<bool> {
        for sync in &self.syncs {
            match sync.is_done(completed)? {
                Some(true) => {}
                Some(false) => return Ok(false),
                None => return Ok(self.over_at.is_some_and(|value| value <= completed)),
            }
        }
        Ok(true)
    }
}

impl Drop for SwapchainResources {
    fn drop(&mut self) {
        match self.wait_persistently() {
            Ok(()) => {}
            // A lost device uses no objects.
            Err(error @ Error::DeviceLost { .. }) => {
                log::error!("{}: its last images may not be shown: {error}", readable_name(&*self.name));
            }
            Err(error) => {
                log::error!(
                    "{}: {error}; its swapchain is leaked with its device, because the window may still use it",
                    readable_name(&*self.name)
                );
                std::mem::forget((self.current.take(), std::mem::take(&mut self.retired)));
                return;
            }
        }
        let all = self.semaphores.drain(..).map(|(semaphore, _)| semaphore).chain(self.signalled.take());
        for semaphore in all {
            // SAFETY: the owner has waited until the GPU is done with the swapchain.
            unsafe { self.gpu.device.destroy_semaphore(semaphore, None) };
        }
    }
}
