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
    window: [u32; 2],
    changed: Option<Instant>,
    failures: u32,
}

impl ResizeDebounce {
    /// For pictures of this size.
    pub(super) fn new(pictures: [u32; 2]) -> Self {
        Self { pictures, window: pictures, changed: None, failures: 0 }
    }

    /// Returns the size of pictures.
    pub(super) fn pictures(&self) -> [u32; 2] {
        self.pictures
    }

    /// Takes the current size of the window. Returns a size that pictures are to get, once; then [`resized`](Self::resized) or
    /// [`failed`](Self::failed) says whether they have it.
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
        is_news.then_some(self.window)
    }

    /// Records that the pictures have the size of the window.
    pub(super) fn resized(&mut self) {
        self.pictures = self.window;
    }

    /// Records that the pictures keep their size. Returns true if they are to be tried again after a rest.
    pub(super) fn failed(&mut self, now: Instant) -> bool {
        self.failures += 1;
        let is_tried_again = self.failures < TRIES;
        self.changed = is_tried_again.then_some(now);
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
        resize.resized();
        assert_eq!(resize.next([10, 8], at(600)), None, "once");
        for (time, size) in [(700, [0, 0]), (900, [0, 0]), (1000, [10, 8]), (1200, [10, 8])] {
            assert_eq!(resize.next(size, at(time)), None, "minimised and back again");
        }
    }

    /// Gives the window another size, in which pictures fail this many times.
    fn fail(resize: &mut ResizeDebounce, size: [u32; 2], times: u32, now: Instant) {
        assert_eq!(resize.next(size, now), None);
        for time in 1..=times {
            let now = now + 2 * time * REST;
            assert_eq!(resize.next(size, now), Some(size), "try {time}");
            assert_eq!(resize.failed(now), time < TRIES);
            assert_eq!(resize.next(size, now + REST / 2), None, "a rest comes first");
        }
    }

    #[test]
    fn pictures_are_tried_three_times_in_a_size() {
        let start = Instant::now();
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut resize = ResizeDebounce::new([8, 8]);
        fail(&mut resize, [9, 8], 3, at(0));
        assert_eq!(resize.next([9, 8], at(9)), None, "given up");
        assert_eq!(resize.pictures(), [8, 8]);
        // When the window comes back to a size in which pictures failed, they are tried anew.
        fail(&mut resize, [10, 8], 1, at(10));
        fail(&mut resize, [9, 8], 2, at(20));
        assert_eq!(resize.next([9, 8], at(30)), Some([9, 8]));
        resize.resized();
        assert_eq!(resize.next([9, 8], at(40)), None);
        assert_eq!(resize.pictures(), [9, 8]);
    }
}
