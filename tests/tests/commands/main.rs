//! Command buffers and queues: order, barriers, threads and measurements.

mod barriers;
mod device_loss;
mod profiler;
mod queries;
mod queue_failures;
mod queue_refusals;
mod queues;
mod submission;
mod threads;
mod timestamps;
mod unordered_queues;
