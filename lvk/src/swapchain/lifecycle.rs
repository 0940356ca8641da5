//! The course of a swapchain: when it is made anew, and which image the application has. Knows no device; the
//! presentation engine is an [`Engine`], so that a scripted one can take its place.

use super::choose::Failure;
use crate::error::Result;

/// What a swapchain lives on.
pub(crate) trait Engine {
    /// Size that images would have now; `None` where nothing can be shown.
    fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure>;

    /// Gives the window another surface, and the swapchain up.
    fn renew_surface(&mut self) -> Result<(), Failure>;

    /// Makes the swapchain anew. Where that fails, there is none.
    fn rebuild(&mut self, extent: [u32; 2]) -> Result<(), Failure>;

    /// Takes the next image of the swapchain.
    fn acquire(&mut self) -> Result<Acquired, Failure>;
}

/// What the engine answers to those who want an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acquired {
    Image {
        index: u32,
        /// The window could be shown better by a new swapchain.
        suboptimal: bool,
    },
    /// None is free within the time allowed, for example of a hidden window.
    NotYet,
}

/// What is known of the swapchain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Condition {
    Good,
    /// Some say so for as long as they live, so that only another size is a reason to make it anew.
    Suboptimal,
    OutOfDate,
    SurfaceLost,
}

/// An image that the application has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Taken {
    pub(crate) index: u32,
    /// Another one each time the image is given out.
    pub(crate) ticket: u64,
}

/// Where a swapchain stands.
#[derive(Debug)]
pub(crate) struct Course {
    condition: Condition,
    /// Size of the images.
    extent: Option<[u32; 2]>,
    taken: Option<u32>,
    tickets: u64,
}

/// A window that changes faster than swapchains are made is left for the next frame.
const ATTEMPTS: u32 = 4;

impl Course {
    /// There is no swapchain yet.
    pub(crate) fn new() -> Self {
        Self { condition: Condition::OutOfDate, extent: None, taken: None, tickets: 0 }
    }

    /// The image to draw into; `None` where nothing can be shown for now. What was taken and not presented comes again.
    pub(crate) fn next(&mut self, name: &str, engine: &mut impl Engine) -> Result<Option<Taken>> {
        let index = self.drive(name, engine, |course, engine| match course.taken {
            Some(index) => Ok(Some(index)),
            None => course.acquire(engine),
        })?;
        Ok(index.flatten().map(|index| {
            self.tickets += 1;
            Taken { index, ticket: self.tickets }
        }))
    }

    /// Makes the swapchain, if its window has a size.
    pub(crate) fn prepare(&mut self, name: &str, engine: &mut impl Engine) -> Result<()> {
        self.drive(name, engine, |_, _| Ok(())).map(drop)
    }

    /// Gets the swapchain in order and runs `last`; `None` where nothing can be shown for now.
    fn drive<E: Engine, T>(
        &mut self,
        name: &str,
        engine: &mut E,
        last: impl Fn(&mut Self, &mut E) -> Result<T, Failure>,
    ) -> Result<Option<T>> {
        let mut lost = false;
        for _ in 0..ATTEMPTS {
            let step = match self.condition {
                Condition::Good => last(self, engine).map(Step::Done),
                _ => self.mend(engine),
            };
            match step {
                Ok(Step::Again) => {}
                Ok(Step::Nothing) => return Ok(None),
                Ok(Step::Done(done)) => return Ok(Some(done)),
                Err(Failure::OutOfDate) => self.condition = Condition::OutOfDate,
                Err(Failure::SurfaceLost) if lost => return Err(Failure::SurfaceLost.into_error(name)),
                Err(Failure::SurfaceLost) => {
                    lost = true;
                    self.condition = Condition::SurfaceLost;
                }
                Err(Failure::Other(error)) => return Err(error),
            }
        }
        Ok(None)
    }

    /// One step towards a good swapchain.
    fn mend<T>(&mut self, engine: &mut impl Engine) -> Result<Step<T>, Failure> {
        match self.condition {
            Condition::SurfaceLost => {
                self.taken = None;
                engine.renew_surface()?;
                self.condition = Condition::OutOfDate;
            }
            Condition::OutOfDate => {
                let Some(extent) = engine.extent()? else { return Ok(Step::Nothing) };
                (self.taken, self.extent) = (None, None);
                engine.rebuild(extent)?;
                self.extent = Some(extent);
                self.condition = Condition::Good;
            }
            Condition::Suboptimal => {
                let fits = engine.extent()? == self.extent;
                self.condition = if fits { Condition::Good } else { Condition::OutOfDate };
            }
            Condition::Good => {}
        }
        Ok(Step::Again)
    }

    fn acquire(&mut self, engine: &mut impl Engine) -> Result<Option<u32>, Failure> {
        let Acquired::Image { index, suboptimal } = engine.acquire()? else { return Ok(None) };
        self.taken = Some(index);
        if suboptimal {
            self.condition = Condition::Suboptimal;
        }
        Ok(Some(index))
    }

    /// The image that the holder of this ticket has; `None` where it was given out again, presented, or is gone.
    pub(crate) fn taken(&self, ticket: u64) -> Option<u32> {
        self.taken.filter(|_| ticket == self.tickets)
    }

    /// The image was handed to the engine, which answered whether the swapchain could be better.
    pub(crate) fn presented(&mut self, answer: Result<bool, Failure>) -> Result<()> {
        self.taken = None;
        match (self.condition, answer) {
            (_, Err(Failure::Other(error))) => {
                self.condition = Condition::OutOfDate;
                return Err(error);
            }
            (Condition::SurfaceLost, _) | (_, Err(Failure::SurfaceLost)) => {
                self.condition = Condition::SurfaceLost;
            }
            (Condition::OutOfDate, _) | (_, Err(Failure::OutOfDate)) => {
                self.condition = Condition::OutOfDate;
            }
            (_, Ok(true)) => self.condition = Condition::Suboptimal,
            (_, Ok(false)) => {}
        }
        Ok(())
    }

    /// The swapchain is to be made anew before its next image.
    pub(crate) fn outdate(&mut self) {
        if self.condition != Condition::SurfaceLost {
            self.condition = Condition::OutOfDate;
        }
    }

    /// Size of the images; `None` where there are none.
    pub(crate) fn extent(&self) -> Option<[u32; 2]> {
        self.extent
    }
}

enum Step<T> {
    Again,
    Nothing,
    Done(T),
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;
    use crate::error::Error;

    /// What happens to a scripted engine at one call.
    #[derive(Debug, Clone, Copy)]
    enum Event {
        Calm,
        Resize([u32; 2]),
        Lose,
        /// No image is free, where one is asked for.
        Busy,
        /// The engine says "suboptimal" from here on, whatever the size.
        Grumble,
    }

    /// A window that follows a script and asserts that it is treated as Vulkan demands.
    #[derive(Debug)]
    struct Scripted {
        script: VecDeque<Event>,
        window: [u32; 2],
        images: Option<[u32; 2]>,
        lost: bool,
        /// The images no longer fit, and the application was told.
        told: bool,
        asked: bool,
        taken: Option<u32>,
        next: u32,
        grumbles: bool,
        rebuilds: u32,
    }

    impl Scripted {
        fn new(script: Vec<Event>) -> Self {
            Self {
                script: script.into(),
                window: [8, 8],
                images: None,
                lost: false,
                told: true,
                asked: false,
                taken: None,
                next: 0,
                grumbles: false,
                rebuilds: 0,
            }
        }

        fn happen(&mut self) -> Event {
            let event = self.script.pop_front().unwrap_or(Event::Calm);
            match event {
                Event::Resize(size) => self.window = size,
                Event::Lose => self.lost = true,
                Event::Grumble => self.grumbles = true,
                Event::Calm | Event::Busy => {}
            }
            event
        }

        /// Every other misfit is only suboptimal, as drivers differ.
        fn misfit(&mut self) -> Result<bool, Failure> {
            if self.lost {
                return Err(Failure::SurfaceLost);
            }
            if self.images != Some(self.window) && !self.next.is_multiple_of(2) {
                self.told = true;
                return Err(Failure::OutOfDate);
            }
            self.told |= self.images != Some(self.window);
            Ok(self.grumbles || self.images != Some(self.window))
        }

        fn present(&mut self, index: u32) -> Result<bool, Failure> {
            assert_eq!(self.taken.take(), Some(index));
            self.happen();
            self.misfit()
        }
    }

    impl Engine for Scripted {
        fn extent(&mut self) -> Result<Option<[u32; 2]>, Failure> {
            self.happen();
            if self.lost {
                return Err(Failure::SurfaceLost);
            }
            self.told |= self.images != Some(self.window);
            Ok((!self.window.contains(&0)).then_some(self.window))
        }

        fn renew_surface(&mut self) -> Result<(), Failure> {
            assert!(self.lost, "a surface that is there is not to be renewed");
            (self.lost, self.images, self.taken, self.told) = (false, None, None, true);
            self.happen();
            Ok(())
        }

        fn rebuild(&mut self, extent: [u32; 2]) -> Result<(), Failure> {
            assert!(!extent.contains(&0), "images have texels");
            assert!(self.told || self.asked, "a swapchain that fits is not made anew");
            (self.images, self.taken, self.told, self.asked) = (None, None, false, false);
            self.rebuilds += 1;
            if self.lost {
                return Err(Failure::SurfaceLost);
            }
            self.images = Some(extent);
            Ok(())
        }

        fn acquire(&mut self) -> Result<Acquired, Failure> {
            assert!(self.images.is_some(), "there is no swapchain");
            assert_eq!(self.taken, None, "one image at a time is sure to come");
            if matches!(self.happen(), Event::Busy) {
                return Ok(Acquired::NotYet);
            }
            let suboptimal = self.misfit()?;
            self.next += 1;
            self.taken = Some(self.next % 3);
            Ok(Acquired::Image { index: self.next % 3, suboptimal })
        }
    }

    /// What an application does in a frame.
    #[derive(Debug, Clone, Copy)]
    enum Frame {
        Present,
        Drop,
        Resize,
    }

    fn event() -> impl Strategy<Value = Event> {
        let side = || prop_oneof![1 => Just(0_u32), 5 => 1..100_u32];
        prop_oneof![
            8 => Just(Event::Calm),
            4 => [side(), side()].prop_map(Event::Resize),
            1 => Just(Event::Lose),
            1 => Just(Event::Busy),
            1 => Just(Event::Grumble),
        ]
    }

    fn frames() -> impl Strategy<Value = Vec<Frame>> {
        let frame = prop_oneof![5 => Just(Frame::Present), 1 => Just(Frame::Drop), 1 => Just(Frame::Resize)];
        prop::collection::vec(frame, 1..40)
    }

    fn play(course: &mut Course, engine: &mut Scripted, frames: &[Frame]) {
        for frame in frames {
            if matches!(frame, Frame::Resize) {
                course.outdate();
                engine.asked = true;
            }
            // A window lost twice in one frame counts as gone.
            let Ok(Some(taken)) = course.next("window", engine) else { continue };
            assert_eq!(engine.taken, Some(taken.index));
            assert_eq!(course.taken(taken.ticket), Some(taken.index));
            assert_eq!(course.taken(taken.ticket - 1), None, "an older ticket is worth nothing");
            if matches!(frame, Frame::Present) {
                let answer = engine.present(taken.index);
                course.presented(answer).unwrap();
                assert_eq!(course.taken(taken.ticket), None);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

        /// Through resizes, losses and hidden windows: the engine's own assertions hold, and once the window is left
        /// alone there is a picture of its size every frame, with no swapchain made any more.
        #[test]
        fn every_window_is_followed_and_a_calm_one_is_left_alone(
            script in prop::collection::vec(event(), 0..80), frames in frames()
        ) {
            let (mut course, mut engine) = (Course::new(), Scripted::new(script));
            play(&mut course, &mut engine, &frames);
            engine.script.clear();
            engine.window = engine.window.map(|side| side.max(1));
            play(&mut course, &mut engine, &[Frame::Present; 4]);
            let rebuilds = engine.rebuilds;
            for _ in 0..6 {
                let taken = course.next("window", &mut engine).unwrap().unwrap();
                prop_assert_eq!(course.extent(), Some(engine.window));
                prop_assert_eq!(engine.images, Some(engine.window));
                let answer = engine.present(taken.index);
                course.presented(answer).unwrap();
            }
            prop_assert_eq!(engine.rebuilds, rebuilds);
        }
    }

    #[test]
    fn a_minimised_window_costs_no_swapchain_and_comes_back() {
        let (mut course, mut engine) = (Course::new(), Scripted::new(vec![Event::Resize([0, 0])]));
        for _ in 0..3 {
            assert_eq!(course.next("window", &mut engine).unwrap(), None);
        }
        assert_eq!((engine.rebuilds, course.extent()), (0, None));
        engine.window = [4, 4];
        assert!(course.next("window", &mut engine).unwrap().is_some());
        assert_eq!((engine.rebuilds, course.extent()), (1, Some([4, 4])));
    }

    #[test]
    fn an_image_that_is_not_presented_comes_again_under_another_ticket() {
        let (mut course, mut engine) = (Course::new(), Scripted::new(Vec::new()));
        let first = course.next("window", &mut engine).unwrap().unwrap();
        let second = course.next("window", &mut engine).unwrap().unwrap();
        assert_eq!(first.index, second.index);
        assert_eq!(course.taken(first.ticket), None);
        assert_eq!(course.taken(second.ticket), Some(second.index));
    }

    #[test]
    fn a_window_that_is_lost_again_and_again_is_gone() {
        let (mut course, mut engine) =
            (Course::new(), Scripted::new(vec![Event::Lose, Event::Calm, Event::Lose]));
        let error = course.next("main window", &mut engine).unwrap_err().to_string();
        assert!(error.contains("main window") && error.contains("gone"), "{error}");
    }

    #[test]
    fn a_failure_that_no_swapchain_helps_with_is_answered_once() {
        let (mut course, mut engine) = (Course::new(), Scripted::new(Vec::new()));
        course.next("window", &mut engine).unwrap();
        let lost = Error::DeviceLost { call: "vkQueuePresentKHR", fault: None };
        assert!(matches!(course.presented(Err(Failure::Other(lost))), Err(Error::DeviceLost { .. })));
    }
}
