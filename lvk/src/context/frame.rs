//! Frames in flight: the CPU may be so many frames ahead of the GPU, and no more.

use std::collections::VecDeque;
use std::sync::PoisonError;

use super::Context;
use crate::error::Result;

/// A frame about to be recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// Counts up from 0.
    pub number: u64,
    /// Counts round below the frames in flight: the GPU is done with everything the last frame of this index used.
    pub index: usize,
}

/// The last submission before each of the latest frames.
#[derive(Debug)]
pub(super) struct FrameRing {
    in_flight: usize,
    next: u64,
    ends: VecDeque<u64>,
}

impl FrameRing {
    const MOST: u32 = 8;

    pub(super) fn new(frames_in_flight: u32) -> Self {
        let in_flight = frames_in_flight.clamp(1, Self::MOST) as usize;
        Self { in_flight, next: 0, ends: VecDeque::with_capacity(in_flight) }
    }

    /// Starts a frame, with `submitted` the last submission before it. Answers the frame and the submission to wait
    /// for: the last one of the frame that used its index before.
    fn start(&mut self, submitted: u64) -> (Frame, u64) {
        if self.next > 0 {
            self.ends.push_back(submitted);
        }
        let full = self.ends.len() >= self.in_flight;
        let wait_for = if full { self.ends.pop_front() } else { None };
        let frame = Frame { number: self.next, index: (self.next % self.in_flight as u64) as usize };
        self.next += 1;
        (frame, wait_for.unwrap_or(0))
    }
}

impl Context {
    /// Starts a frame: waits until the GPU is done with the frame that last had the same index, so that one set of
    /// per-frame buffers for each index is enough.
    pub fn next_frame(&self) -> Result<Frame> {
        let submitted = self.shared().submitter.submitted();
        let (frame, wait_for) = {
            let mut frames = self.inner.frames.lock().unwrap_or_else(PoisonError::into_inner);
            frames.start(submitted)
        };
        self.shared().profiler.begin_frame(frame.number);
        self.wait(self.submission(wait_for))?;
        self.advance_compactions();
        Ok(frame)
    }

    /// How many frames the CPU may be ahead of the GPU.
    pub fn frames_in_flight(&self) -> usize {
        self.inner.frames.lock().unwrap_or_else(PoisonError::into_inner).in_flight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_waits_for_the_last_submission_of_the_frame_with_its_index() {
        let mut ring = FrameRing::new(2);
        assert_eq!(ring.start(3), (Frame { number: 0, index: 0 }, 0));
        assert_eq!(ring.start(5), (Frame { number: 1, index: 1 }, 0));
        assert_eq!(ring.start(9), (Frame { number: 2, index: 0 }, 5));
        assert_eq!(ring.start(9), (Frame { number: 3, index: 1 }, 9));
    }

    #[test]
    fn one_frame_in_flight_waits_for_the_frame_before() {
        let mut ring = FrameRing::new(0);
        assert_eq!(ring.start(0).1, 0);
        assert_eq!(ring.start(7).1, 7);
        assert_eq!(ring.start(8).1, 8);
    }
}
