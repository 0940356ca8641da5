//! Submission to the queue: command buffers, the timeline, barriers between command buffers, deferred destruction.

pub(crate) mod command_ring;
pub(crate) mod deferred;
pub(crate) mod emit;
pub(crate) mod input_sets;
pub(crate) mod presentable;
pub(crate) mod profiler;
pub(crate) mod queue;
pub(crate) mod scope_tree;
pub(crate) mod timeline;

pub(crate) use queue::{Recording, Submission, Submitter};
pub use scope_tree::{GpuProfile, GpuScope};
pub use timeline::SubmitHandle;
