//! The clock of a window's animation.

use std::time::{Duration, Instant};

use crate::app::sample::FrameTime;

/// The clock of a window's animation.
#[derive(Debug)]
pub(super) struct Clock {
    start: Instant,
    latest: Instant,
    animation: Duration,
    /// Frames that were shown while the animation went on.
    frames: u32,
}

impl Clock {
    /// The animation begins.
    pub(super) fn new(now: Instant) -> Self {
        Self { start: now, latest: now, animation: Duration::ZERO, frames: 0 }
    }

    /// Goes on to `now`; the animation too, if it goes on. Answers the seconds since the last time.
    pub(super) fn tick(&mut self, now: Instant, animates: bool) -> f32 {
        let step = now.duration_since(self.latest);
        self.latest = now;
        self.animation += if animates { step } else { Duration::ZERO };
        step.as_secs_f32()
    }

    /// A frame was shown.
    pub(super) fn count_frame(&mut self, animates: bool) {
        self.frames += u32::from(animates);
    }

    /// The frame time in rounds of `frames_per_round` frames: by the clock, or frame by frame, so that each run shows the
    /// same frames.
    pub(super) fn frame_time(&self, by_frame: bool, frames_per_round: u32) -> FrameTime {
        match by_frame {
            true => FrameTime::from_frame(self.frames, frames_per_round),
            false => FrameTime::from_millis(self.animation.as_millis() as u32, frames_per_round),
        }
    }

    /// Seconds since the window was opened.
    pub(super) fn seconds(&self) -> f64 {
        self.latest.duration_since(self.start).as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Duration = Duration::from_millis(250);

    /// A clock after frames of a quarter of a second, in which the animation went on or stood.
    fn after(animates: &[bool]) -> Clock {
        let start = Instant::now();
        let mut clock = Clock::new(start);
        for (number, animates) in (1..).zip(animates) {
            assert_eq!(clock.tick(start + number * STEP, *animates), 0.25);
            clock.count_frame(*animates);
        }
        clock
    }

    #[test]
    fn a_paused_animation_keeps_its_frame_time_in_both_clocks() {
        let (all, some) = (after(&[true; 6]), after(&[true, false, false, true, false, true]));
        for (by_frame, six, three) in [(true, 6, 3), (false, 1500, 750)] {
            assert_eq!(all.frame_time(by_frame, 240).frame, six);
            assert_eq!(some.frame_time(by_frame, 240).frame, three);
        }
        assert_eq!(some.seconds(), 1.5, "the window's own time goes on");
    }
}
