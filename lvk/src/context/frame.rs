//! Frames in flight: limits how many frames the CPU may be ahead of the GPU.

use std::collections::VecDeque;

use super::Context;
use crate::cpu_scope::cpu_scope;
use crate::error::Result;
use crate::submit::last_access::PerQueue;

/// A frame about to be recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// Frame number, counting from 0.
    pub number: u64,
    /// Frame number modulo the frames in flight. The GPU is done with everything that the previous frame of this index
    /// used.
    pub index: usize,
}

/// The last submissions before each of the latest frames.
#[derive(Debug)]
pub(super) struct FrameRing {
    in_flight: usize,
    next: u64,
    ends: VecDeque<PerQueue<u64>>,
}

impl FrameRing {
    const MAX_FRAMES: u32 = 8;

    pub(super) fn new(frames_in_flight: u32) -> Self {
        let in_flight = frames_in_flight.clamp(1, Self::MAX_FRAMES) as usize;
        Self { in_flight, next: 0, ends: VecDeque::with_capacity(in_flight) }
    }

    /// Starts a frame. `submitted` holds the last submission before it, for each queue. Returns the frame and the
    /// submissions to wait for: the last ones of the previous frame with the same index.
    fn start_frame(&mut self, submitted: PerQueue<u64>) -> (Frame, PerQueue<u64>) {
        if self.next > 0 {
            self.ends.push_back(submitted);
        }
        let full = self.ends.len() >= self.in_flight;
        let wait_for = if full { self.ends.pop_front() } else { None };
        let frame = Frame { number: self.next, index: (self.next % self.in_flight as u64) as usize };
        self.next += 1;
        (frame, wait_for.unwrap_or_default())
    }
}

impl Context {
    /// Starts a frame. Waits until the GPU is done with the previous frame of the same index. One set of per-frame
    /// buffers for each index is therefore enough. On other queues this holds for [`submit`](Self::submit), but not for
    /// [`submit_in_background`](Self::submit_in_background).
    pub fn next_frame(&self) -> Result<Frame> {
        cpu_scope!("next frame");
        let submitted = self.device_state().submitter.foreground_values();
        let (frame, wait_for) = {
            let mut frames = self.inner.frames.lock();
            frames.start_frame(submitted)
        };
        self.device_state().profiler.begin_frame(frame.number);
        self.device_state().submitter.wait_for_queues(&wait_for)?;
        self.device_state().collect_known()?;
        self.advance_compactions();
        Ok(frame)
    }

    /// Returns the number of frames that the CPU may be ahead of the GPU.
    pub fn frames_in_flight(&self) -> usize {
        self.inner.frames.lock().in_flight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_waits_for_the_last_submission_of_the_frame_with_its_index() {
        let mut ring = FrameRing::new(2);
        assert_eq!(ring.start_frame([3, 0, 0]), (Frame { number: 0, index: 0 }, [0; 3]));
        assert_eq!(ring.start_frame([5, 4, 0]), (Frame { number: 1, index: 1 }, [0; 3]));
        assert_eq!(ring.start_frame([9, 4, 7]), (Frame { number: 2, index: 0 }, [5, 4, 0]));
        assert_eq!(ring.start_frame([9, 4, 7]), (Frame { number: 3, index: 1 }, [9, 4, 7]));
    }

    #[test]
    fn one_frame_in_flight_waits_for_the_frame_before() {
        let mut ring = FrameRing::new(0);
        assert_eq!(ring.start_frame([0; 3]).1, [0; 3]);
        assert_eq!(ring.start_frame([7, 0, 0]).1, [7, 0, 0]);
        assert_eq!(ring.start_frame([8, 0, 0]).1, [8, 0, 0]);
    }
}
