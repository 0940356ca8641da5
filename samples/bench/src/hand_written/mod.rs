//! What `lvk` does, by hand: the same Vulkan calls without it, on the same device, as the measure of its cost.
//!
//! Memory is one allocation for each buffer, but for what measures memory itself, and every submission is waited for: fine for
//! a benchmark that keeps few objects and times single frames.

mod buffer;
mod commands;
mod device;
mod objects;
mod pipeline;
mod recorder;
mod structure;

pub(super) use commands::RawCommands;
pub(super) use device::RawDevice;
pub(super) use objects::{Memory, RawObjects};
pub(super) use pipeline::RawTracing;
pub(super) use recorder::RawRecorder;
pub(super) use structure::{RawStructure, instance_geometry, triangle_geometry};
