//! Command buffers, and queues that run them: order, barriers, threads, and what they measure.

mod barriers;
mod profiler;
mod queries;
mod queue_failures;
mod queue_refusals;
mod queues;
mod submission;
mod threads;
mod timestamps;
