//! What the samples share around a frame: command line, pictures, measures, timings and progress.

pub mod args;
pub mod metrics;
pub mod png;
pub mod progress;
pub mod timings;
