//! Debounces changes of a window's size.

use std::time::{Duration, Instant};

/// Time that a window must keep its size. The image is stretched meanwhile, as samples recreate many resources for another
/// size.
const REST: Duration = Duration::from_millis(150);

/// The current size of images, and the latest size of the window.
#[derive(Debug)]
pub(super) struct ResizeDebounce {
    pictures: [u32; 2],
    window: [u32; 2],
    changed: Option<Instant>,
}

impl ResizeDebounce {
    /// For pictures of this size.
    pub(super) fn new(pictures: [u32; 2]) -> Self {
        Self { pictures, window: pictures, changed: None }
    }

    /// The window has this size now. Answers a size that pictures are to get, once.
    pub(super) fn next(&mut self, window: [u32; 2], now: Instant) -> Option<[u32; 2]> {
        if window != self.window {
            (self.window, self.changed) = (window, Some(now));
        }
        let rests = self.changed.is_some_and(|changed| now.duration_since(changed) >= REST);
        if !rests {
            return None;
        }
        self.changed = None;
        let is_news = self.window != self.pictures && !self.window.contains(&0);
        self.pictures = if is_news { self.window } else { self.pictures };
        is_news.then_some(self.window)
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
}
