//! State of swapchain images: the presentation engine or the application owns an image, and the first submission waits
//! for its acquisition.

use std::sync::Arc;

use ash::vk;

use crate::barrier::{IdMap, QueueState, ResourceId, Stages, TextureShape, Tracker};
use crate::error::{Error, Result};

/// Every image of a swapchain, until its texture is destroyed.
#[derive(Debug, Default)]
pub(crate) struct Presentables(IdMap<Presentable>);

#[derive(Debug)]
struct Presentable {
    name: Arc<str>,
    held: PresentableOwner,
}

/// Owner of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PresentableOwner {
    /// The presentation engine.
    Engine,
    /// The application. The presentation engine signals the semaphore when it has released the image. The first
    /// submission that uses the image takes the semaphore and waits for it.
    Application(Option<vk::Semaphore>),
    /// No owner: the swapchain was recreated.
    Retired,
}

/// Wait of the first submission that uses an acquired image, at these stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AcquireWait {
    pub(crate) semaphore: vk::Semaphore,
    pub(crate) stages: Stages,
}

impl Presentables {
    /// Adds a new image, owned by the presentation engine.
    pub(crate) fn insert(&mut self, id: ResourceId, name: &Arc<str>) {
        self.0.insert(id, Presentable { name: Arc::clone(name), held: PresentableOwner::Engine });
    }

    /// Makes the application the owner. The presentation engine signals `semaphore` once it has released the image.
    pub(crate) fn acquire(&mut self, id: ResourceId, semaphore: vk::Semaphore) {
        self.set_owner(id, PresentableOwner::Application(Some(semaphore)));
    }

    /// Makes the presentation engine the owner.
    pub(crate) fn present(&mut self, id: ResourceId) {
        self.set_owner(id, PresentableOwner::Engine);
    }

    /// Forbids all later use of the image. Returns the acquire semaphore if no submission has waited for it.
    pub(crate) fn retire(&mut self, id: ResourceId) -> Option<vk::Semaphore> {
        match self.set_owner(id, PresentableOwner::Retired) {
            Some(PresentableOwner::Application(unwaited)) => unwaited,
            _ => None,
        }
    }

    /// Forgets a destroyed image.
    pub(crate) fn forget(&mut self, id: ResourceId) {
        self.0.remove(&id);
    }

    /// Fails if a command buffer uses an image that the application has not acquired.
    pub(crate) fn check_acquired(&self, tracker: &Tracker) -> Result<()> {
        for (id, image) in &self.0 {
            if tracker.first_stages(*id).is_none() {
                continue;
            }
            let message = match image.held {
                PresentableOwner::Application(_) => continue,
                PresentableOwner::Engine => {
                    "its image is with the presentation engine; use it between next_image and present"
                }
                PresentableOwner::Retired => {
                    "the swapchain was made anew since the image was taken; take one with next_image again"
                }
            };
            return Err(Error::usage(&*image.name, message));
        }
        Ok(())
    }

    /// Takes the waits for images that `tracker` is the first to use. Their contents become undefined.
    pub(crate) fn take_waits(&mut self, tracker: &Tracker, states: &mut QueueState) -> Vec<AcquireWait> {
        let mut waits = Vec::new();
        for (id, image) in &mut self.0 {
            let PresentableOwner::Application(pending) = &mut image.held else { continue };
            let Some(first) = tracker.first_stages(*id) else { continue };
            let Some(semaphore) = pending.take() else { continue };
            // A command buffer that only presents has no stage of its own.
            let stages = if first.is_empty() { Stages::COLOR } else { first };
            states.mark_acquired(*id, TextureShape { mips: 1, layers: 1 }, stages);
            waits.push(AcquireWait { semaphore, stages });
        }
        waits
    }

    fn set_owner(&mut self, id: ResourceId, held: PresentableOwner) -> Option<PresentableOwner> {
        self.0.get_mut(&id).map(|image| std::mem::replace(&mut image.held, held))
    }
}

#[cfg(test)]
mod tests {
    use ash::vk::Handle;

    use super::*;
    use crate::barrier::{Barriers, Layout, Use};

    const ONE: TextureShape = TextureShape { mips: 1, layers: 1 };

    fn tracker(id: ResourceId, uses: &[Use]) -> Tracker {
        let mut tracker = Tracker::default();
        uses.iter().for_each(|next| {
            tracker.use_texture(id, ONE, ONE.all_subresources(), *next, &mut Barriers::default())
        });
        tracker
    }

    fn presentables(id: ResourceId) -> Presentables {
        let mut images = Presentables::default();
        images.insert(id, &Arc::from("window"));
        images
    }

    #[test]
    fn an_image_can_be_used_only_between_acquisition_and_presentation() {
        let (id, semaphore) = (ResourceId(1), vk::Semaphore::from_raw(7));
        let drawing = tracker(id, &[Use::color_target(false), Use::present()]);
        let mut images = presentables(id);
        let refusal = |images: &Presentables| images.check_acquired(&drawing).unwrap_err().to_string();
        assert!(refusal(&images).contains("presentation engine"));
        images.acquire(id, semaphore);
        images.check_acquired(&drawing).unwrap();
        images.present(id);
        assert!(refusal(&images).contains("presentation engine"));
        assert_eq!(images.retire(id), None);
        assert!(refusal(&images).contains("made anew"));
        images.check_acquired(&tracker(ResourceId(2), &[Use::color_target(false)])).unwrap();
        images.forget(id);
        images.check_acquired(&drawing).unwrap();
    }

    #[test]
    fn only_the_first_user_waits_and_its_barrier_chains_with_the_wait() {
        let (id, semaphore) = (ResourceId(1), vk::Semaphore::from_raw(7));
        let (mut images, mut states) = (presentables(id), QueueState::default());
        for (first, stages) in [
            (Use::color_target(false), Stages::COLOR),
            (Use::transfer_write(), Stages::TRANSFER),
            (Use::present(), Stages::COLOR),
        ] {
            images.acquire(id, semaphore);
            let frame = tracker(id, &[first, Use::present()]);
            assert_eq!(images.take_waits(&frame, &mut states), [AcquireWait { semaphore, stages }]);
            let barrier = states.submit(&frame).images[0].scopes;
            assert_eq!((barrier.src_stages, barrier.old_layout), (stages, Layout::Undefined));
            assert_eq!(images.take_waits(&frame, &mut states), []);
            images.present(id);
        }
    }

    #[test]
    fn a_retired_image_leaves_the_semaphore_without_a_wait() {
        let (id, semaphore) = (ResourceId(1), vk::Semaphore::from_raw(7));
        let mut images = presentables(id);
        images.acquire(id, semaphore);
        assert_eq!(images.retire(id), Some(semaphore));
        assert_eq!(images.retire(id), None);
        let mut images = presentables(id);
        images.acquire(id, semaphore);
        images.take_waits(&tracker(id, &[Use::color_target(false)]), &mut QueueState::default());
        assert_eq!(images.retire(id), None);
    }
}
