//! Debounces changes of a window's size.

use std::time::{Duration, Instant};

/// Time that a window must keep its size. The image is stretched meanwhile, as samples recreate many resources for another
/// size.
const REST: Duration = Duration::from_millis(150);

/// Times that pictures are tried in a size of the window: memory may be short for a moment.
const TRIES: u32 = 3;

/// The current size of images, and the latest size of the window.
#[derive(Debug)]
pub(super) struct ResizeDebounce {
    pictures: [u32; 2],
    before: [u32; 2],
    window: [u32; 2],
    changed: Option<Instant>,
    failures: u32,
}

impl ResizeDebounce {
    /// For pictures of this size.
    pub(super) fn new(pictures: [u32; 2]) -> Self {
        Self { pictures, before: pictures, window: pictures, changed: None, failures: 0 }
    }

    /// Returns the size of pictures.
    pub(super) fn pictures(&self) -> [u32; 2] {
        self.pictures
    }

    /// The window has this size now. Answers a size that pictures are to get, once; [`failed`](Self::failed) makes it another time.
    pub(super) fn next(&mut self, window: [u32; 2], now: Instant) -> Option<[u32; 2]> {
        if window != self.window {
            (self.window, self.changed, self.failures) = (window, Some(now), 0);
        }
        let rests = self.changed.is_some_and(|changed| now.duration_since(changed) >= REST);
        if !rests {
            return None;
        }
        self.changed = None;
        let is_news = self.window != self.pictures && !self.window.contains(&0);
        if is_news {
            self.before = std::mem::replace(&mut self.pictures, self.window);
        }
        is_news.then_some(self.window)
    }

    /// The pictures could not get the size that [`next`](Self::next) answered. Returns true if they are to be tried again after a rest.
    pub(super) fn failed(&mut self, now: Instant) -> bool {
        self.failures += 1;
        let is_tried_again = self.failures < TRIES;
        if is_tried_again {
            (self.pictures, self.changed) = (self.before, Some(now));
        }
        is_tried_again
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_follow_when_the_window_rests() {
        let start = Instant::now();
        let at = |milliseconds| start + Duration::from_millis(milliseconds);
        let mut resize = ResizeDebounce::new([8, 8]);
        assert_eq!(resize.next([8, 8], at(0)), None);
        assert_eq!(resize.next([9, 8], at(10)), None);
        assert_eq!(resize.next([10, 8], at(150)), None, "still under way");
        assert_eq!(resize.next([10, 8], at(290)), None);
        assert_eq!(resize.next([10, 8], at(300)), Some([10, 8]));
        assert_eq!(resize.next([10, 8], at(600)), None, "once");
        for (time, size) in [(700, [0, 0]), (900, [0, 0]), (1000, [10, 8]), (1200, [10, 8])] {
            assert_eq!(resize.next(size, at(time)), None, "minimised and back again");
        }
    }

    #[test]
    fn pictures_are_tried_three_times_in_a_size() {
        let start = Instant::now();
        let at = |milliseconds| start + Duration::from_millis(milliseconds);
        let mut resize = ResizeDebounce::new([8, 8]);
        for size in [[9, 8], [10, 8]] {
            assert_eq!(resize.next(size, at(0)), None);
            assert_eq!(resize.next(size, at(200)), Some(size));
            assert!(resize.failed(at(200)));
            assert_eq!(resize.next(size, at(300)), None, "a rest comes first");
            assert_eq!(resize.next(size, at(400)), Some(size));
            assert!(resize.failed(at(400)));
            assert_eq!(resize.next(size, at(600)), Some(size));
            assert!(!resize.failed(at(600)));
            assert_eq!(resize.next(size, at(900)), None, "given up");
        }
        // A failure leaves the size to come back to.
        assert_eq!(resize.next([11, 8], at(1000)), None);
        assert_eq!(resize.next([11, 8], at(1200)), Some([11, 8]));
        assert!(resize.failed(at(1200)));
        assert_eq!(resize.pictures(), [10, 8]);
    }
}
