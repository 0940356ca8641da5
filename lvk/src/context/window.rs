//! Swapchains: creation, acquisition and presentation of images.

use std::sync::Arc;

use ash::vk;

use super::Context;
use super::create_texture::default_views;
use super::destroy::Destroy;
use super::holder::Holder;
use crate::command::CommandBuffer;
use crate::device_state::DeferredObject;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};
use crate::format::Format;
use crate::gpu::start::window::WindowHandles;
use crate::handle::SwapchainHandle;
use crate::resource::Texture;
use crate::resource::image::Image;
use crate::resource::image_usage::{raw_usage, usage_from_features};
use crate::resource::texture_desc::TextureDesc;
use crate::submit::{Submission, SubmitHandle};
use crate::swapchain::chain::{Chain, ChainPlan, PresentSync};
use crate::swapchain::choose;
use crate::swapchain::desc::{PresentMode, SwapchainDesc, SwapchainImage, SwapchainInfo};
use crate::swapchain::failure::{Failure, check_surface_is_gone};
use crate::swapchain::lifecycle::{Acquired, PresentBackend};
use crate::swapchain::state::{
    ChainImage, Current, Swapchain, SwapchainConfig, SwapchainInner, SwapchainResources,
};
use crate::swapchain::surface::{Surface, SurfaceState};

impl Destroy for SwapchainHandle {
    /// Destroys the swapchain and its images, including an acquired one.
    fn destroy_in(self, ctx: &Context) -> Result<()> {
        ctx.retire_swapchain(ctx.device_state().store.swapchains.remove(self)?);
        Ok(())
    }
}

impl Context {
    /// Creates a swapchain for a window (`vkCreateSwapchainKHR`). See [`manual::windows`](crate::manual::windows).
    ///
    /// A minimised window may get its images later: until then [`SwapchainInfo::extent`] is zero.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) without a window, and for a window that has a swapchain already;
    /// [`Unsupported`](Error::Unsupported) where the context was created without a window, where the device cannot
    /// present to the window, and for usages that images of the window cannot have.
    pub fn create_swapchain(&self, desc: &SwapchainDesc<'_>) -> Result<Holder<SwapchainHandle>> {
        let shared = self.device_state();
        let name = desc.debug_name;
        let no_window = || Error::usage(name, "give it a window, here or in ContextDesc::window");
        let window = desc.window.as_ref().or(self.inner.window.as_ref()).ok_or_else(no_window)?;
        if desc.usage.is_empty() {
            return Err(Error::usage(name, "give its images at least one usage"));
        }
        desc.hdr.map_or(Ok(()), |hdr| hdr.check()).map_err(|why| Error::usage(name, why))?;
        let wishes = SwapchainConfig {
            extent: desc.extent,
            present_modes: desc.present_modes.to_vec(),
            color_spaces: desc.color_spaces.to_vec(),
            hdr: desc.hdr,
            usage: desc.usage,
            image_count: desc.image_count,
        };
        let surface = Surface::new(&shared.gpu, window, name);
        let surface = surface.map_err(|error| Failure::from(error).into_error(name))?;
        let handle = shared.store.swapchains.insert(Swapchain::new(name, surface, wishes, &shared.gpu));
        let holder = Holder::new(self, handle, 0);
        let swapchain = shared.store.swapchains.get(handle)?;
        let mut guard = swapchain.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        let mut live = LiveBackend { ctx: self, name: &swapchain.name, resources };
        shared.submitter.explain_loss(lifecycle.prepare(name, &mut live))?;
        drop(guard);
        Ok(holder)
    }

    /// Acquires the next image to draw into (`vkAcquireNextImageKHR`), for one [`present`](Self::present). Returns
    /// `None` if no image can be presented at the moment, because the window is minimised, hidden or being resized. The
    /// application then continues with the next frame.
    ///
    /// Waits for at most a second if the presentation engine holds all images. Recreates the swapchain if the window
    /// has changed, without waiting for the GPU. An acquired image that was not presented is returned again; the
    /// earlier value for it is then invalid.
    ///
    /// # Errors
    /// [`SurfaceLost`](Error::SurfaceLost) when the window is destroyed; [`InvalidUsage`](Error::InvalidUsage) if another
    /// swapchain or program has taken the window when the images must be created again; [`StaleHandle`](Error::StaleHandle).
    pub fn next_image(&self, swapchain: SwapchainHandle) -> Result<Option<SwapchainImage>> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut guard = object.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        self.check_alive(swapchain)?;
        let mut live = LiveBackend { ctx: self, name: &object.name, resources };
        let acquired = lifecycle.acquire_image(&object.name, &mut live);
        let Some(acquired) = self.device_state().submitter.explain_loss(acquired)? else { return Ok(None) };
        let image = resources.current.as_ref().and_then(|current| {
            let image = current.images.get(acquired.index as usize)?;
            Some(SwapchainImage {
                swapchain,
                texture: image.texture,
                index: image.object.slot,
                extent: current.plan.extent,
                format: current.plan.format,
                ticket: acquired.ticket,
            })
        });
        Ok(image)
    }

    /// Submits a command buffer that draws into an image, and presents the image when the submission is done
    /// (`vkQueuePresentKHR`).
    ///
    /// Earlier command buffers may have drawn into the image as well. A swapchain that is out of date is not an error:
    /// the next [`next_image`](Self::next_image) recreates it.
    ///
    /// # Errors
    /// Those of [`submit`](Self::submit), which leave the image as it was before; [`InvalidUsage`](Error::InvalidUsage)
    /// for an image that was acquired again since, or whose swapchain was recreated.
    pub fn present(&self, mut cmd: CommandBuffer, image: SwapchainImage) -> Result<SubmitHandle> {
        let shared = self.device_state();
        self.check_same_context(&cmd)?;
        let swapchain = shared.store.swapchains.get(image.swapchain)?;
        let mut guard = swapchain.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        let outdated = || {
            let message = "the image was given out again, or the swapchain was made anew; present what next_image \
                           answered last";
            Error::usage(&*swapchain.name, message)
        };
        let index = lifecycle.acquired_index(image.ticket).ok_or_else(outdated)?;
        let current = resources.current.as_mut().ok_or_else(outdated)?;
        let mode = current.mode;
        let shown = current.images.get_mut(index as usize).ok_or_else(outdated)?;
        cmd.release_image(&shown.object)?;
        shown.sync.reset()?;
        shown.sync.came_back |= std::mem::replace(&mut shown.sync.presented, false);
        let drawn = vk::SemaphoreSubmitInfo::default()
            .semaphore(shown.sync.drawn)
            .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS);
        let presented = Some(shown.object.image.id);
        let more = Submission { signals: vec![drawn], presented, ..Submission::default() };
        let submission = self.submit_with_semaphores(cmd, more)?;
        shown.sync.drawn_at = submission.value;
        let answer = current.chain.present(index, mode, &shown.sync);
        // Even if the window has changed, the engine waits for the semaphore and signals the fence.
        shown.sync.presented = matches!(answer, Ok(_) | Err(Failure::OutOfDate | Failure::SurfaceLost(_)));
        if std::mem::take(&mut shown.sync.came_back) {
            resources.set_presents_done_at(submission.value);
        }
        if let Some(semaphore) = resources.signalled.take() {
            resources.recycle_semaphore(semaphore, submission.value);
        }
        shared.submitter.explain_loss(lifecycle.record_present(&swapchain.name, answer))?;
        Ok(submission)
    }

    /// Sets the size of the window in pixels; a 0 means that the window is minimised. Costs nothing if the size is
    /// unchanged. Needed only on Wayland, and for windows that are minimised without a change of size.
    pub fn resize_swapchain(&self, swapchain: SwapchainHandle, extent: [u32; 2]) -> Result<()> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut state = object.lock();
        let before = std::mem::replace(&mut state.resources.config.extent, extent);
        if before != extent {
            state.lifecycle.mark_out_of_date();
        }
        Ok(())
    }

    /// Destroys the images, the `VkSwapchainKHR` and the `VkSurfaceKHR` of a swapchain before it returns, so that its
    /// window can go, as an Android application's does when it is paused. Waits for the GPU. The handle stays:
    /// [`next_image`](Self::next_image) returns `None` until [`resume_swapchain`](Self::resume_swapchain). Costs
    /// nothing if the surface is gone already.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) if views of its images, or command buffers that were not submitted, keep
    /// the surface: the surface is destroyed when they are dropped. After a shortage of memory the surface may stay; another
    /// call tries again. The swapchain is suspended in these cases too. [`DeviceLost`](Error::DeviceLost),
    /// [`StaleHandle`](Error::StaleHandle).
    pub fn suspend_swapchain(&self, swapchain: SwapchainHandle) -> Result<()> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut guard = object.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        let mut live = LiveBackend { ctx: self, name: &object.name, resources };
        let suspended = lifecycle.suspend(&object.name, &mut live);
        self.device_state().submitter.explain_loss(suspended)?;
        check_surface_is_gone(&object.name, resources.is_released_surface_kept())
    }

    /// Continues a swapchain in `window`: another one, or its own, which the window system has given back. Creates
    /// surface and images with the properties of [`SwapchainDesc`], as
    /// [`create_swapchain`](Self::create_swapchain) does; the format may differ from that of the last window. A
    /// swapchain that is not suspended is suspended first.
    ///
    /// # Errors
    /// Those of [`create_swapchain`](Self::create_swapchain); the swapchain is then suspended.
    /// [`InvalidUsage`](Error::InvalidUsage) if its former surface still has the window, because views of its images or command
    /// buffers keep that.
    /// [`StaleHandle`](Error::StaleHandle).
    pub fn resume_swapchain(
        &self,
        swapchain: SwapchainHandle,
        window: &Arc<dyn WindowHandles>,
        extent: [u32; 2],
    ) -> Result<()> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut guard = object.lock();
        self.check_alive(swapchain)?;
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        resources.window = Arc::clone(window);
        resources.config.extent = extent;
        let mut live = LiveBackend { ctx: self, name: &object.name, resources };
        let resumed = lifecycle.resume(&object.name, &mut live);
        self.device_state().submitter.explain_loss(resumed)
    }

    /// Sets the present mode to the first supported mode of `wishes`, or to [`PresentMode::Fifo`]. If the device cannot
    /// change the mode of a single image, the next [`next_image`](Self::next_image) recreates the swapchain.
    pub fn set_present_mode(&self, swapchain: SwapchainHandle, wishes: &[PresentMode]) -> Result<()> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut state = object.lock();
        let SwapchainInner { lifecycle, resources } = &mut *state;
        resources.config.present_modes = wishes.to_vec();
        if let Some(current) = &mut resources.current {
            let mode = choose::choose_present_mode(wishes, &current.offered_modes);
            if current.plan.modes.contains(&mode) {
                current.mode = mode;
            } else {
                lifecycle.mark_out_of_date();
            }
        }
        Ok(())
    }

    /// Returns the current properties of the swapchain.
    ///
    /// # Errors
    /// [`StaleHandle`](Error::StaleHandle); [`Unsupported`](Error::Unsupported) if a recreated swapchain would have no
    /// images, because the window supports none of the formats; [`InvalidUsage`](Error::InvalidUsage) while it is
    /// suspended, because its properties follow from its window, and if the window is in use;
    /// [`SurfaceLost`](Error::SurfaceLost) if it is gone.
    pub fn swapchain_info(&self, swapchain: SwapchainHandle) -> Result<SwapchainInfo> {
        let object = self.device_state().store.swapchains.get(swapchain)?;
        let mut guard = object.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        if lifecycle.is_suspended() {
            return Err(Error::usage(&*object.name, "it is suspended; resume it in a window first"));
        }
        let rebuilds = resources.rebuilds.saturating_sub(1);
        if let Some(current) = &resources.current {
            return Ok(SwapchainInfo {
                extent: lifecycle.extent().unwrap_or_default(),
                format: current.plan.format,
                color_space: current.plan.color_space,
                present_mode: current.mode,
                present_modes: current.offered_modes.clone(),
                image_count: current.images.len() as u32,
                rebuilds,
            });
        }
        let mut live = LiveBackend { ctx: self, name: &object.name, resources };
        let planned =
            live.surface().and_then(|surface| live.choose_chain(&surface, &surface.state()?, [0; 2]));
        let (present_modes, plan) = planned.map_err(|failure| failure.into_error(&object.name))?;
        Ok(SwapchainInfo {
            extent: [0, 0],
            format: plan.format,
            color_space: plan.color_space,
            present_mode: plan.modes.first().copied().unwrap_or_default(),
            present_modes,
            image_count: plan.image_count,
            rebuilds,
        })
    }

    /// Retires the images of a swapchain, and defers the destruction of the swapchain.
    fn retire_swapchain(&self, swapchain: Arc<Swapchain>) {
        let mut guard = swapchain.lock();
        let SwapchainInner { lifecycle, resources } = &mut *guard;
        lifecycle.mark_out_of_date();
        let mut live = LiveBackend { ctx: self, name: &swapchain.name, resources };
        if let Err(error) = live.retire_current() {
            log::error!("{}: an acquired image cannot be released: {error}", readable_name(&*swapchain.name));
        }
        drop(guard);
        self.device_state().free_later(DeferredObject::Swapchain(swapchain));
    }

    /// Fails if another thread destroyed the swapchain while this one waited for its lock.
    fn check_alive(&self, swapchain: SwapchainHandle) -> Result<()> {
        self.device_state().store.swapchains.get(swapchain).map(drop)
    }
}

/// A locked swapchain with the context and name that its images are created with.
struct LiveBackend<'a> {
    ctx: &'a Context,
    name: &'a Arc<str>,
    resources: &'a mut SwapchainResources,
}

impl PresentBackend for LiveBackend<'_> {
    fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure> {
        let state = self.surface()?.state()?;
        Ok(choose::choose_extent(&state.limits, self.resources.config.extent))
    }

    /// Waits for the GPU: this is rare, and swapchains must be destroyed before the window can have another surface.
    fn release_surface(&mut self) -> Result<(), Failure> {
        if !self.resources.has_surface() {
            return Ok(());
        }
        let is_loss = |result: &Result<()>| matches!(result, Err(Error::DeviceLost { .. }));
        // The first call that finds the device lost is in the report, and the next may find that too.
        let waited = self.resources.wait_for_presents();
        let mut released = self.ctx.device_state().submitter.explain_loss(waited);
        if released.is_ok() || is_loss(&released) {
            released = released.and(self.retire_current());
            let idle = self.ctx.wait_idle();
            released = released.and(idle);
        }
        // A lost device uses no objects.
        if released.is_ok() || is_loss(&released) {
            self.resources.release();
        }
        Ok(released?)
    }

    fn create_surface(&mut self) -> Result<(), Failure> {
        self.surface().map(drop)
    }

    fn recreate_swapchain(&mut self, extent: [u32; 2]) -> Result<(), Failure> {
        let surface = self.surface()?;
        let (offered_modes, plan) = self.choose_chain(&surface, &surface.state()?, extent)?;
        let old = self.resources.current.as_ref().map(|current| Arc::clone(&current.chain));
        let made = Chain::new(&surface, &plan, old.as_deref(), self.name);
        let made = made.map_err(|failure| match failure {
            Failure::Other(error) => Failure::Other(self.ctx.device_state().submitter.explain_error(error)),
            of_window => self.explain(of_window),
        });
        let retired = self.retire_current();
        if made.is_err()
            && let Err(error) = &retired
        {
            log::error!("{}: an acquired image cannot be released: {error}", readable_name(&**self.name));
        }
        let chain = Arc::new(made?);
        retired?;
        if let Some(hdr) = &self.resources.config.hdr {
            chain.set_hdr(hdr)?;
        }
        let mode = plan.modes.first().copied().unwrap_or_default();
        let images = self.new_images(&chain, &plan)?;
        self.resources.current = Some(Current { images, plan, mode, offered_modes, chain });
        self.resources.rebuilds += 1;
        Ok(())
    }

    fn acquire(&mut self) -> Result<Acquired, Failure> {
        let submitter = &self.ctx.device_state().submitter;
        // Only the graphics queue uses images of windows, so background work of other queues delays nothing.
        let completed = submitter.completed_of(0)?;
        self.resources.destroy_finished(completed)?;
        let Some(current) = &self.resources.current else { return Err(Failure::OutOfDate) };
        let (chain, ids) = (Arc::clone(&current.chain), current.ids());
        let semaphore = self.resources.take_semaphore(completed, self.name)?;
        let answer = chain.acquire(semaphore);
        let acquired = match answer {
            Ok(Acquired::Image { index, .. }) => ids.get(index as usize),
            _ => None,
        };
        match acquired {
            Some(id) => {
                submitter.with_presentables(|images| images.acquire(*id, semaphore));
                self.resources.signalled = Some(semaphore);
            }
            None => self.resources.recycle_semaphore(semaphore, 0),
        }
        answer
    }
}

impl LiveBackend<'_> {
    /// Returns why a window is in use, if a surface that was released still has it.
    fn explain(&mut self, failure: Failure) -> Failure {
        match failure {
            Failure::WindowInUse(error) if self.resources.is_window_kept() => Failure::FormerSurface(error),
            other => other,
        }
    }

    /// Returns the surface. Creates another one if the last was lost.
    fn surface(&mut self) -> Result<Arc<Surface>, Failure> {
        if let Some(surface) = &self.resources.surface {
            return Ok(Arc::clone(surface));
        }
        let created = Surface::new(&self.resources.gpu, &self.resources.window, self.name);
        let surface = created.map_err(|error| self.explain(error.into()))?;
        Ok(Arc::clone(self.resources.surface.insert(Arc::new(surface))))
    }

    /// Returns the supported present modes, and the creation parameters of the Vulkan swapchain.
    fn choose_chain(
        &self,
        surface: &Surface,
        state: &SurfaceState,
        extent: [u32; 2],
    ) -> Result<(Vec<PresentMode>, ChainPlan), Failure> {
        let (gpu, wishes) = (&self.resources.gpu, &self.resources.config);
        let refused = |why: String| Error::unsupported(format!("swapchain '{}'", self.name), why);
        let usable = |format: Format| usage_from_features(gpu.format_features(format)).contains(wishes.usage);
        let offered = surface.formats()?;
        let (format, color_space) = choose::choose_surface_format(&wishes.color_spaces, &offered, usable)
            .ok_or_else(|| {
                refused(format!("the window supports no format with the usage {:?}", wishes.usage))
            })?;
        let copies = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let usage = raw_usage(wishes.usage, format) | copies;
        if !state.raw.supported_usage_flags.contains(usage) {
            let why = format!("images of the window cannot be used for {:?} and copies", wishes.usage);
            return Err(refused(why).into());
        }
        let modes = surface.present_modes()?;
        let mode = choose::choose_present_mode(&wishes.present_modes, &modes);
        let identity = vk::SurfaceTransformFlagsKHR::IDENTITY;
        let can_stay = state.raw.supported_transforms.contains(identity);
        let plan = ChainPlan {
            extent,
            format,
            color_space,
            modes: surface.compatible_modes(mode)?,
            image_count: choose::choose_image_count(&state.limits, wishes.image_count, mode),
            usage,
            transform: if can_stay { identity } else { state.raw.current_transform },
            alpha: choose::choose_composite_alpha(state.raw.supported_composite_alpha),
        };
        Ok((modes, plan))
    }

    fn new_images(&mut self, chain: &Arc<Chain>, plan: &ChainPlan) -> Result<Vec<ChainImage>, Failure> {
        let mut images = Vec::new();
        for raw in chain.images()? {
            match self.new_image(chain, plan, raw) {
                Ok(image) => images.push(image),
                Err(error) => {
                    self.free_unused_images(images);
                    return Err(error.into());
                }
            }
        }
        Ok(images)
    }

    /// Destroys images that no caller has seen, and so no command, at once: they keep a `VkSwapchainKHR` of the window, which another
    /// try cannot have beside it.
    fn free_unused_images(&self, images: Vec<ChainImage>) {
        let shared = self.ctx.device_state();
        for image in images {
            if shared.store.textures.remove(image.texture).is_ok() {
                shared.free_now(DeferredObject::Texture(image.object));
            }
        }
    }

    /// Creates the texture of one swapchain image, with a slot of its own.
    fn new_image(&self, chain: &Arc<Chain>, plan: &ChainPlan, raw: vk::Image) -> Result<ChainImage> {
        let shared = self.ctx.device_state();
        let sync = PresentSync::new(&shared.gpu, self.name)?;
        let slot = shared.reserve_slot(|| shared.bindless.reserve_texture(self.name))?;
        let desc = TextureDesc {
            format: plan.format,
            extent: plan.extent,
            usage: self.resources.config.usage,
            debug_name: self.name,
            ..Default::default()
        };
        let image =
            Image::import(&shared.gpu, &desc, raw).inspect_err(|_| shared.bindless.free_texture(slot))?;
        let texture =
            Texture::from_image(&shared.gpu, &desc, image.with_external_owner(Arc::clone(chain) as _), slot);
        let views = default_views(&texture).inspect_err(|_| shared.bindless.free_texture(slot))?;
        shared.bindless.set_texture(slot, views);
        shared.submitter.with_presentables(|images| images.insert(texture.image.id, self.name));
        shared.submitter.restrict_to_graphics(texture.image.id, self.name);
        let handle = shared.store.textures.insert(texture);
        Ok(ChainImage { texture: handle, object: shared.store.textures.get(handle)?, sync })
    }

    /// Retires the Vulkan swapchain. Its images and presents live until they are no longer in use.
    fn retire_current(&mut self) -> Result<()> {
        let Some(current) = self.resources.current.take() else { return Ok(()) };
        let (syncs, released) = self.retire_images(current.images);
        self.resources.retire(current.chain, syncs);
        if let Some(semaphore) = self.resources.signalled.take() {
            // Without a wait the semaphore stays signalled, so no other acquisition may have it. The wait was in a submission that
            // failed, or could not be submitted.
            let submitter = &self.ctx.device_state().submitter;
            let is_waited_for = released.is_ok() && !submitter.is_broken();
            let free_at = if is_waited_for { submitter.last_of_queues()[0] } else { u64::MAX };
            self.resources.recycle_semaphore(semaphore, free_at);
        }
        released
    }

    /// Destroys the textures of images. Submits waits for images that were acquired and not used, and returns the result
    /// of that submission.
    fn retire_images(&mut self, images: Vec<ChainImage>) -> (Vec<PresentSync>, Result<()>) {
        let shared = self.ctx.device_state();
        let mut waits = Vec::new();
        let mut syncs = Vec::new();
        for image in images {
            let id = image.object.image.id;
            waits.extend(shared.submitter.with_presentables(|presentables| presentables.retire(id)));
            if shared.store.textures.remove(image.texture).is_ok() {
                shared.free_later(DeferredObject::Texture(image.object));
            }
            syncs.push(image.sync);
        }
        let released = if waits.is_empty() { Ok(()) } else { self.wait_for_semaphores(&waits) };
        (syncs, released)
    }

    /// Submits waits for signalled semaphores, which can be used again only after a wait.
    fn wait_for_semaphores(&self, semaphores: &[vk::Semaphore]) -> Result<()> {
        let wait = |semaphore: &vk::Semaphore| {
            vk::SemaphoreSubmitInfo::default()
                .semaphore(*semaphore)
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let waits = semaphores.iter().map(wait).collect();
        let submission = Submission { waits, ..Submission::default() };
        self.ctx.device_state().submitter.submit(submission, || {}).1
    }
}
