//! Lifecycle of a swapchain: its recreation, and the image that the application has acquired. Needs no device: the
//! presentation engine is a [`PresentBackend`], so that tests can use a scripted one.

use super::failure::Failure;
use crate::error::readable::readable_name;
use crate::error::{Error, Result};

/// The presentation engine of a swapchain. There is one implementor besides the scripted engine of the tests. A real
/// engine cannot reproduce each order of failures and recreations.
pub(crate) trait PresentBackend {
    /// Returns the size of new images; `None` if no image can be presented.
    fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure>;

    /// Destroys the swapchain and its surface, if they are there. On failure they may stay, and another call tries again.
    fn release_surface(&mut self) -> Result<(), Failure>;

    /// Creates a surface for the window, which has none.
    fn create_surface(&mut self) -> Result<(), Failure>;

    /// Recreates the swapchain. On failure there is no swapchain.
    fn recreate_swapchain(&mut self, extent: [u32; 2]) -> Result<(), Failure>;

    /// Acquires the next image of the swapchain.
    fn acquire(&mut self) -> Result<Acquired, Failure>;
}

/// Result of an acquisition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acquired {
    Image {
        index: u32,
        /// True if a new swapchain would match the window better.
        suboptimal: bool,
    },
    /// No image became free within the timeout, for example because the window is hidden.
    NotYet,
}

/// Known condition of the swapchain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SwapchainStatus {
    Good,
    /// Some swapchains are suboptimal for their whole life, so only another size is a reason to recreate one.
    Suboptimal,
    OutOfDate,
    SurfaceLost,
    /// The surface is destroyed, and another one is to be created.
    SurfaceReleased,
    /// The surface is destroyed until the application has another window, or has its window back.
    Suspended,
}

/// An image that the application has acquired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AcquiredImage {
    pub(crate) index: u32,
    /// A new number for each time that the image is returned to the application.
    pub(crate) ticket: u64,
}

/// Lifecycle state of a swapchain.
#[derive(Debug)]
pub(crate) struct SwapchainState {
    status: SwapchainStatus,
    /// Size of the images.
    extent: Option<[u32; 2]>,
    acquired: Option<u32>,
    tickets: u64,
}

/// Maximum number of recreation steps. A window that changes faster than swapchains are created is left for the next
/// frame.
const ATTEMPTS: u32 = 5;

impl SwapchainState {
    /// Creates the state before the first swapchain.
    pub(crate) fn new() -> Self {
        Self { status: SwapchainStatus::OutOfDate, extent: None, acquired: None, tickets: 0 }
    }

    /// Returns the image to draw into; `None` if no image can be presented at the moment. An acquired image that was
    /// not presented is returned again.
    pub(crate) fn acquire_image(
        &mut self,
        name: &str,
        backend: &mut impl PresentBackend,
    ) -> Result<Option<AcquiredImage>> {
        let index = self.run_recreating(name, backend, |state, backend| match state.acquired {
            Some(index) => Ok(Some(index)),
            None => state.acquire(backend),
        })?;
        Ok(index.flatten().map(|index| {
            self.tickets += 1;
            AcquiredImage { index, ticket: self.tickets }
        }))
    }

    /// Creates the swapchain, if its window has a size.
    pub(crate) fn prepare(&mut self, name: &str, backend: &mut impl PresentBackend) -> Result<()> {
        self.run_recreating(name, backend, |_, _| Ok(())).map(drop)
    }

    /// Recreates the swapchain if needed and runs `last`. Returns `None` if no image can be presented at the moment.
    fn run_recreating<E: PresentBackend, T>(
        &mut self,
        name: &str,
        backend: &mut E,
        last: impl Fn(&mut Self, &mut E) -> Result<T, Failure>,
    ) -> Result<Option<T>> {
        let mut lost = false;
        for _ in 0..ATTEMPTS {
            let step = match self.status {
                SwapchainStatus::Good => last(self, backend).map(RecreateStep::Done),
                _ => self.recreate(backend),
            };
            match step {
                Ok(RecreateStep::Again) => {}
                Ok(RecreateStep::Nothing) => return Ok(None),
                Ok(RecreateStep::Done(done)) => return Ok(Some(done)),
                Err(Failure::OutOfDate) => self.status = SwapchainStatus::OutOfDate,
                Err(failure @ Failure::SurfaceLost(_)) if lost => return Err(failure.into_error(name)),
                Err(Failure::SurfaceLost(_)) => {
                    lost = true;
                    self.status = SwapchainStatus::SurfaceLost;
                }
                // A driver may answer with any error for a window that is gone. A lost device is none of the window.
                Err(Failure::Other(error))
                    if self.status == SwapchainStatus::SurfaceReleased
                        && !matches!(error, Error::DeviceLost { .. }) =>
                {
                    return Err(Error::SurfaceLost { swapchain: name.to_owned(), source: Box::new(error) });
                }
                Err(failure) => return Err(failure.into_error(name)),
            }
        }
        Ok(None)
    }

    /// Takes one step towards an up-to-date swapchain.
    fn recreate<T>(&mut self, backend: &mut impl PresentBackend) -> Result<RecreateStep<T>, Failure> {
        match self.status {
            SwapchainStatus::SurfaceLost => {
                (self.acquired, self.extent) = (None, None);
                backend.release_surface()?;
                self.status = SwapchainStatus::SurfaceReleased;
            }
            SwapchainStatus::SurfaceReleased => {
                backend.create_surface()?;
                self.status = SwapchainStatus::OutOfDate;
            }
            SwapchainStatus::Suspended => return Ok(RecreateStep::Nothing),
            SwapchainStatus::OutOfDate => {
                let Some(extent) = backend.extent()? else { return Ok(RecreateStep::Nothing) };
                (self.acquired, self.extent) = (None, None);
                backend.recreate_swapchain(extent)?;
                self.extent = Some(extent);
                self.status = SwapchainStatus::Good;
            }
            SwapchainStatus::Suboptimal => {
                let fits = backend.extent()? == self.extent;
                self.status = if fits { SwapchainStatus::Good } else { SwapchainStatus::OutOfDate };
            }
            SwapchainStatus::Good => {}
        }
        Ok(RecreateStep::Again)
    }

    /// Destroys the surface, if it is there. There are no images until [`resume`](Self::resume), also after a failure.
    pub(crate) fn suspend(&mut self, name: &str, backend: &mut impl PresentBackend) -> Result<()> {
        (self.acquired, self.extent) = (None, None);
        self.status = SwapchainStatus::Suspended;
        backend.release_surface().map_err(|failure| failure.into_error(name))
    }

    /// Creates the surface of the window that the engine has now, and the swapchain. On failure the swapchain is
    /// suspended.
    pub(crate) fn resume(&mut self, name: &str, backend: &mut impl PresentBackend) -> Result<()> {
        self.suspend(name, backend)?;
        let resumed = self.start_in_window(name, backend);
        if resumed.is_err()
            && let Err(error) = self.suspend(name, backend)
        {
            log::warn!("{}: its surface stays until it is suspended again: {error}", readable_name(name));
        }
        resumed
    }

    fn start_in_window(&mut self, name: &str, backend: &mut impl PresentBackend) -> Result<()> {
        backend.create_surface().map_err(|failure| failure.into_error(name))?;
        self.status = SwapchainStatus::OutOfDate;
        self.prepare(name, backend)
    }

    fn acquire(&mut self, backend: &mut impl PresentBackend) -> Result<Option<u32>, Failure> {
        let Acquired::Image { index, suboptimal } = backend.acquire()? else { return Ok(None) };
        self.acquired = Some(index);
        if suboptimal {
            self.status = SwapchainStatus::Suboptimal;
        }
        Ok(Some(index))
    }

    /// Returns the index of the image with this ticket. `None` if it was acquired again or presented, or no longer
    /// exists.
    pub(crate) fn acquired_index(&self, ticket: u64) -> Option<u32> {
        self.acquired.filter(|_| ticket == self.tickets)
    }

    /// Records a present of the swapchain `name` and its result, which is true for a suboptimal swapchain.
    pub(crate) fn record_present(&mut self, name: &str, answer: Result<bool, Failure>) -> Result<()> {
        self.acquired = None;
        match (self.status, answer) {
            (SwapchainStatus::Suspended | SwapchainStatus::SurfaceReleased, _) => {}
            (_, Err(failure @ (Failure::Other(_) | Failure::WindowInUse(_) | Failure::FormerSurface(_)))) => {
                self.status = SwapchainStatus::OutOfDate;
                return Err(failure.into_error(name));
            }
            (SwapchainStatus::SurfaceLost, _) | (_, Err(Failure::SurfaceLost(_))) => {
                self.status = SwapchainStatus::SurfaceLost;
            }
            (SwapchainStatus::OutOfDate, _) | (_, Err(Failure::OutOfDate)) => {
                self.status = SwapchainStatus::OutOfDate;
            }
            (_, Ok(true)) => self.status = SwapchainStatus::Suboptimal,
            (_, Ok(false)) => {}
        }
        Ok(())
    }

    /// Marks the swapchain for recreation before its next image.
    pub(crate) fn mark_out_of_date(&mut self) {
        if matches!(self.status, SwapchainStatus::Good | SwapchainStatus::Suboptimal) {
            self.status = SwapchainStatus::OutOfDate;
        }
    }

    /// True between [`suspend`](Self::suspend) and [`resume`](Self::resume).
    pub(crate) fn is_suspended(&self) -> bool {
        self.status == SwapchainStatus::Suspended
    }

    /// Returns the size of the images; `None` if there are none.
    pub(crate) fn extent(&self) -> Option<[u32; 2]> {
        self.extent
    }
}

enum RecreateStep<T> {
    Again,
    Nothing,
    Done(T),
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use ash::vk;
    use proptest::prelude::*;

    use super::*;

    /// Event at one call of a scripted engine.
    #[derive(Debug, Clone, Copy)]
    enum SurfaceEvent {
        Calm,
        Resize([u32; 2]),
        Lose,
        /// No image is free at an acquisition.
        Busy,
        /// The engine reports "suboptimal" from here on, whatever the size.
        Grumble,
    }

    fn lost_surface() -> Failure {
        Failure::from_result("vkAcquireNextImageKHR", "window")(vk::Result::ERROR_SURFACE_LOST_KHR)
    }

    /// A window that follows a script and asserts that its caller meets Vulkan's rules.
    #[derive(Debug)]
    struct Scripted {
        script: VecDeque<SurfaceEvent>,
        window: [u32; 2],
        images: Option<[u32; 2]>,
        has_surface: bool,
        suspends: bool,
        lost: bool,
        /// True if the images no longer match the window, and the engine has reported that.
        told: bool,
        asked: bool,
        acquired: Option<u32>,
        next: u32,
        grumbles: bool,
        rebuilds: u32,
    }

    impl Scripted {
        fn new(script: Vec<SurfaceEvent>) -> Self {
            Self {
                script: script.into(),
                window: [8, 8],
                images: None,
                has_surface: true,
                suspends: false,
                lost: false,
                told: true,
                asked: false,
                acquired: None,
                next: 0,
                grumbles: false,
                rebuilds: 0,
            }
        }

        fn happen(&mut self) -> SurfaceEvent {
            let event = self.script.pop_front().unwrap_or(SurfaceEvent::Calm);
            match event {
                SurfaceEvent::Resize(size) => self.window = size,
                SurfaceEvent::Lose => self.lost = true,
                SurfaceEvent::Grumble => self.grumbles = true,
                SurfaceEvent::Calm | SurfaceEvent::Busy => {}
            }
            event
        }

        /// Returns the engine's result for the current window, which is true for suboptimal. Every other mismatch is
        /// only suboptimal, as drivers differ.
        fn misfit(&mut self) -> Result<bool, Failure> {
            if self.lost {
                return Err(lost_surface());
            }
            if self.images != Some(self.window) && !self.next.is_multiple_of(2) {
                self.told = true;
                return Err(Failure::OutOfDate);
            }
            self.told |= self.images != Some(self.window);
            Ok(self.grumbles || self.images != Some(self.window))
        }

        fn present(&mut self, index: u32) -> Result<bool, Failure> {
            assert_eq!(self.acquired.take(), Some(index));
            self.happen();
            self.misfit()
        }
    }

    impl PresentBackend for Scripted {
        fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure> {
            assert!(self.has_surface, "there is no surface");
            self.happen();
            if self.lost {
                return Err(lost_surface());
            }
            self.told |= self.images != Some(self.window);
            Ok((!self.window.contains(&0)).then_some(self.window))
        }

        fn release_surface(&mut self) -> Result<(), Failure> {
            assert!(self.lost || self.suspends, "a surface that is there is not to be renewed");
            (self.has_surface, self.images, self.acquired) = (false, None, None);
            Ok(())
        }

        fn create_surface(&mut self) -> Result<(), Failure> {
            assert!(!self.has_surface, "a window takes no second surface");
            (self.has_surface, self.lost, self.told) = (true, false, true);
            self.happen();
            Ok(())
        }

        fn recreate_swapchain(&mut self, extent: [u32; 2]) -> Result<(), Failure> {
            assert!(!extent.contains(&0), "images have texels");
            assert!(self.told || self.asked, "a swapchain that fits is not made anew");
            (self.images, self.acquired, self.told, self.asked) = (None, None, false, false);
            self.rebuilds += 1;
            if self.lost {
                return Err(lost_surface());
            }
            self.images = Some(extent);
            Ok(())
        }

        fn acquire(&mut self) -> Result<Acquired, Failure> {
            assert!(self.images.is_some(), "there is no swapchain");
            assert_eq!(self.acquired, None, "one image at a time is sure to come");
            if matches!(self.happen(), SurfaceEvent::Busy) {
                return Ok(Acquired::NotYet);
            }
            let suboptimal = self.misfit()?;
            self.next += 1;
            self.acquired = Some(self.next % 3);
            Ok(Acquired::Image { index: self.next % 3, suboptimal })
        }
    }

    /// Action of an application in a frame.
    #[derive(Debug, Clone, Copy)]
    enum ScriptedFrame {
        Present,
        Drop,
        Resize,
        /// The window goes away, and comes back with the next frame of this kind.
        Suspend,
    }

    fn event() -> impl Strategy<Value = SurfaceEvent> {
        let side = || prop_oneof![1 => Just(0_u32), 5 => 1..100_u32];
        prop_oneof![
            8 => Just(SurfaceEvent::Calm),
            4 => [side(), side()].prop_map(SurfaceEvent::Resize),
            1 => Just(SurfaceEvent::Lose),
            1 => Just(SurfaceEvent::Busy),
            1 => Just(SurfaceEvent::Grumble),
        ]
    }

    fn frames() -> impl Strategy<Value = Vec<ScriptedFrame>> {
        let frame = prop_oneof![5 => Just(ScriptedFrame::Present), 1 => Just(ScriptedFrame::Drop), 1 => Just(ScriptedFrame::Resize), 1 => Just(ScriptedFrame::Suspend)];
        prop::collection::vec(frame, 1..40)
    }

    fn play(state: &mut SwapchainState, backend: &mut Scripted, frames: &[ScriptedFrame]) {
        for frame in frames {
            if matches!(frame, ScriptedFrame::Resize) {
                state.mark_out_of_date();
                backend.asked = true;
            }
            if matches!(frame, ScriptedFrame::Suspend) {
                suspend_or_resume(state, backend);
            }
            if state.is_suspended() {
                assert_eq!(state.acquire_image("window", backend).unwrap(), None);
                assert_eq!((state.extent(), backend.has_surface), (None, false));
                continue;
            }
            // A window lost twice in one frame counts as destroyed.
            let Ok(Some(acquired)) = state.acquire_image("window", backend) else { continue };
            assert_eq!(backend.acquired, Some(acquired.index));
            assert_eq!(state.acquired_index(acquired.ticket), Some(acquired.index));
            assert_eq!(state.acquired_index(acquired.ticket - 1), None, "an older ticket is worth nothing");
            if matches!(frame, ScriptedFrame::Present) {
                let answer = backend.present(acquired.index);
                state.record_present("window", answer).unwrap();
                assert_eq!(state.acquired_index(acquired.ticket), None);
            }
        }
    }

    fn suspend_or_resume(state: &mut SwapchainState, backend: &mut Scripted) {
        backend.suspends = true;
        if state.is_suspended() {
            // The new window may be lost at once. Then its surface is to be replaced as at any other time.
            let _ = state.resume("window", backend);
        } else {
            state.suspend("window", backend).unwrap();
        }
        backend.suspends = false;
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

        /// Survives resizes, losses and hidden windows: the engine's assertions hold. Once the window no longer
        /// changes, each frame has an image of its size, and no more swapchains are created.
        #[test]
        fn every_window_is_followed_and_a_calm_one_is_left_alone(
            script in prop::collection::vec(event(), 0..80), frames in frames()
        ) {
            let (mut state, mut backend) = (SwapchainState::new(), Scripted::new(script));
            play(&mut state, &mut backend, &frames);
            backend.script.clear();
            if state.is_suspended() {
                suspend_or_resume(&mut state, &mut backend);
            }
            backend.window = backend.window.map(|side| side.max(1));
            play(&mut state, &mut backend, &[ScriptedFrame::Present; 4]);
            let rebuilds = backend.rebuilds;
            for _ in 0..6 {
                let acquired = state.acquire_image("window", &mut backend).unwrap().unwrap();
                prop_assert_eq!(state.extent(), Some(backend.window));
                prop_assert_eq!(backend.images, Some(backend.window));
                let answer = backend.present(acquired.index);
                state.record_present("window", answer).unwrap();
            }
            prop_assert_eq!(backend.rebuilds, rebuilds);
        }
    }

    #[test]
    fn a_minimised_window_costs_no_swapchain_and_comes_back() {
        let (mut state, mut backend) =
            (SwapchainState::new(), Scripted::new(vec![SurfaceEvent::Resize([0, 0])]));
        for _ in 0..3 {
            assert_eq!(state.acquire_image("window", &mut backend).unwrap(), None);
        }
        assert_eq!((backend.rebuilds, state.extent()), (0, None));
        backend.window = [4, 4];
        assert!(state.acquire_image("window", &mut backend).unwrap().is_some());
        assert_eq!((backend.rebuilds, state.extent()), (1, Some([4, 4])));
    }

    #[test]
    fn a_suspended_swapchain_has_no_surface_and_its_image_is_no_longer_valid() {
        let (mut state, mut backend) = (SwapchainState::new(), Scripted::new(Vec::new()));
        let first = state.acquire_image("window", &mut backend).unwrap().unwrap();
        suspend_or_resume(&mut state, &mut backend);
        assert_eq!(state.acquired_index(first.ticket), None);
        state.mark_out_of_date();
        state.record_present("window", Err(Failure::OutOfDate)).unwrap();
        assert_eq!(state.acquire_image("window", &mut backend).unwrap(), None);
        assert!(state.is_suspended() && !backend.has_surface);
        backend.window = [3, 5];
        suspend_or_resume(&mut state, &mut backend);
        assert_eq!((state.extent(), backend.rebuilds), (Some([3, 5]), 2));
        let second = state.acquire_image("window", &mut backend).unwrap().unwrap();
        assert!(second.ticket > first.ticket);
    }

    /// A window that takes no surface, or a surface and no swapchain. Tells whether the surface is there.
    #[derive(Default)]
    struct Refusing {
        takes_surface: bool,
        has_surface: bool,
        release_fails: bool,
        /// What Vulkan answers where a surface is created.
        creation_fails: Option<vk::Result>,
    }

    impl PresentBackend for Refusing {
        fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure> {
            assert!(self.has_surface, "there is no surface");
            Ok(Some([8, 8]))
        }
        fn release_surface(&mut self) -> Result<(), Failure> {
            if self.release_fails && self.has_surface {
                return Err(
                    Error::vulkan("vkQueueWaitIdle", "window")(vk::Result::ERROR_OUT_OF_HOST_MEMORY).into()
                );
            }
            self.has_surface = false;
            Ok(())
        }
        fn create_surface(&mut self) -> Result<(), Failure> {
            assert!(!self.has_surface, "a window takes no second surface");
            if let Some(result) = self.creation_fails {
                return Err(Error::vulkan("vkCreateXcbSurfaceKHR", "window")(result).into());
            }
            self.has_surface = self.takes_surface;
            let refused = || Error::unsupported("presentation to this window", "a test").into();
            self.takes_surface.then_some(()).ok_or_else(refused)
        }
        fn recreate_swapchain(&mut self, _: [u32; 2]) -> Result<(), Failure> {
            assert!(self.has_surface, "there is no surface");
            Err(Error::unsupported("a swapchain of this window", "a test").into())
        }
        fn acquire(&mut self) -> Result<Acquired, Failure> {
            panic!("there is no swapchain")
        }
    }

    #[test]
    fn a_window_that_takes_no_surface_or_no_swapchain_leaves_the_swapchain_suspended() {
        for takes_surface in [false, true] {
            let mut backend = Refusing { takes_surface, ..Default::default() };
            let mut state = SwapchainState::new();
            let error = state.resume("window", &mut backend).unwrap_err();
            assert!(matches!(error, Error::Unsupported { .. }), "{error:?}");
            assert!(state.is_suspended() && !backend.has_surface, "{takes_surface}");
            assert_eq!(state.acquire_image("window", &mut backend).unwrap(), None);
        }
        // The window of a lost surface has had one before, so its refusal is a loss.
        let mut backend = Refusing::default();
        let mut state = SwapchainState::new();
        state.status = SwapchainStatus::SurfaceLost;
        let error = state.acquire_image("window", &mut backend).unwrap_err();
        assert!(matches!(error, Error::SurfaceLost { .. }), "{error:?}");
    }

    /// Drivers answer with a shortage of memory for windows that are gone too. The cause is in the error, and the next call tries again.
    #[test]
    fn the_cause_is_told_where_a_window_takes_no_other_surface() {
        let mut state = SwapchainState::new();
        state.status = SwapchainStatus::SurfaceLost;
        let mut backend = Refusing { takes_surface: true, ..Default::default() };
        for result in [
            vk::Result::ERROR_OUT_OF_HOST_MEMORY,
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
            vk::Result::ERROR_DEVICE_LOST,
        ] {
            backend.creation_fails = Some(result);
            let error = state.acquire_image("window", &mut backend).unwrap_err();
            assert!(error.to_string().contains("vkCreateXcbSurfaceKHR"), "{error}");
            let is_lost_device = matches!(error, Error::DeviceLost { .. });
            assert_eq!(is_lost_device, result == vk::Result::ERROR_DEVICE_LOST, "{error:?}");
            assert_eq!(matches!(error, Error::SurfaceLost { .. }), !is_lost_device, "{error:?}");
        }
        backend.creation_fails = None;
        let error = state.acquire_image("window", &mut backend).unwrap_err();
        assert!(backend.has_surface && matches!(error, Error::Unsupported { .. }), "{error:?}");
    }

    /// A surface that stays, as the wait for its presents failed, is destroyed by the next call.
    #[test]
    fn a_surface_that_cannot_be_destroyed_is_told_each_time() {
        let mut backend = Refusing { takes_surface: true, release_fails: true, ..Default::default() };
        let mut state = SwapchainState::new();
        let error = state.resume("window", &mut backend).unwrap_err();
        assert!(matches!(error, Error::Unsupported { .. }), "the first error is the cause: {error:?}");
        for _ in 0..2 {
            assert!(state.is_suspended() && backend.has_surface);
            assert!(matches!(state.suspend("window", &mut backend), Err(Error::OutOfHostMemory { .. })));
            assert!(matches!(state.resume("window", &mut backend), Err(Error::OutOfHostMemory { .. })));
        }
        backend.release_fails = false;
        state.suspend("window", &mut backend).unwrap();
        assert!(state.is_suspended() && !backend.has_surface);
    }

    #[test]
    fn an_image_that_is_not_presented_comes_again_under_another_ticket() {
        let (mut state, mut backend) = (SwapchainState::new(), Scripted::new(Vec::new()));
        let first = state.acquire_image("window", &mut backend).unwrap().unwrap();
        let second = state.acquire_image("window", &mut backend).unwrap().unwrap();
        assert_eq!(first.index, second.index);
        assert_eq!(state.acquired_index(first.ticket), None);
        assert_eq!(state.acquired_index(second.ticket), Some(second.index));
    }

    #[test]
    fn a_window_that_is_lost_again_and_again_is_gone() {
        let (mut state, mut backend) = (
            SwapchainState::new(),
            Scripted::new(vec![SurfaceEvent::Lose, SurfaceEvent::Calm, SurfaceEvent::Lose]),
        );
        let error = state.acquire_image("main window", &mut backend).unwrap_err().to_string();
        assert!(error.contains("main window") && error.contains("gone"), "{error}");
    }

    #[test]
    fn a_failure_that_no_swapchain_helps_with_is_answered_once() {
        let (mut state, mut backend) = (SwapchainState::new(), Scripted::new(Vec::new()));
        state.acquire_image("window", &mut backend).unwrap();
        let lost = Error::device_lost("vkQueuePresentKHR", "main window");
        assert!(matches!(
            state.record_present("window", Err(Failure::Other(lost))),
            Err(Error::DeviceLost { .. })
        ));
    }
}
