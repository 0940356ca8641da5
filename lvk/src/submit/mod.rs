//! Submission to queues: command buffers, the timeline, barriers between command buffers, deferred destruction.

mod batches;
pub(crate) mod command_ring;
pub(crate) mod deferred;
pub(crate) mod emit;
pub(crate) mod input_sets;
#[cfg(feature = "test-hooks")]
pub(crate) mod interruption;
pub(crate) mod lanes;
#[cfg(test)]
mod lanes_model;
#[cfg(test)]
mod lanes_tests;
pub(crate) mod ownership;
pub(crate) mod presentable;
pub(crate) mod profiler;
pub(crate) mod queue;
pub(crate) mod recording;
pub(crate) mod scope_tree;
pub(crate) mod timeline;

pub(crate) use queue::{Finished, Submission, Submitter};
pub(crate) use recording::Recording;
pub use scope_tree::{GpuProfile, GpuScope};
pub use timeline::SubmitHandle;
