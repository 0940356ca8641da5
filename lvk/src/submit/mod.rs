//! Submission to queues: command buffers, the timeline, barriers between command buffers, deferred destruction.

mod batches;
pub(crate) mod command_pool;
mod completion;
pub(crate) mod deferred_free;
pub(crate) mod emit_barriers;
pub(crate) mod exchanged_layout;
pub(crate) mod input_attachment_sets;
pub(crate) mod label_trail;
pub(crate) mod last_access;
mod loss_report;
#[cfg_attr(not(any(feature = "window", test)), expect(dead_code, reason = "only swapchains present"))]
pub(crate) mod presentable;
pub(crate) mod profiler;
pub(crate) mod queue;
pub(crate) mod queue_sync;
#[cfg(test)]
mod queue_sync_model;
#[cfg(test)]
mod queue_sync_tests;
pub(crate) mod recording;
pub(crate) mod scope_tree;
pub(crate) mod timeline;
#[cfg(feature = "tracy")]
mod tracy_zones;
mod unobserved;

pub(crate) use queue::{Finished, Submission, Submitter};
pub(crate) use recording::Recording;
pub use scope_tree::{GpuProfile, GpuScope};
pub use timeline::SubmitHandle;
