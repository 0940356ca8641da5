//! Hand-written Vulkan: the calls that `lvk` makes, without `lvk`, on the same device, as the reference for its cost.
//!
//! Each buffer has its own allocation, except in the benchmark of allocations. The code waits for every submission. Both are
//! sufficient for a benchmark with few objects and single frames.

mod accel_struct;
mod buffer;
mod command_pool;
mod commands;
mod device;
mod frame_ring;
mod objects;
mod recorder;
mod rt_pipeline;
mod timeline;

pub(super) use accel_struct::{RawAccelStruct, instance_geometry, triangle_geometry};
pub(super) use commands::RawCommands;
pub(super) use device::RawDevice;
pub(super) use frame_ring::RawFrameRing;
pub(super) use objects::{Memory, RawObjects};
pub(super) use recorder::RawRecorder;
pub(super) use rt_pipeline::{RawTracing, StackSize};
