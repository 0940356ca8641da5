//! `bench peers`: the same work by several Vulkan libraries, each beside hand-written Vulkan.
//!
//! This module measures `lvk` and plain `ash`. The crate `lvk-bench-peers` adds other libraries, each a [`PeerEntry`]. A row
//! is measured in a child process for each peer: a peer that leaks, aborts or changes settings of its process does not affect
//! the others. The parent process asks the children in turn, so that clocks and temperatures are equal for all of them.

mod answer;
mod args;
mod ash_peer;
mod child;
mod cold_build;
mod glsl;
mod gpu_timer;
mod lvk_peer;
mod measure;
mod peer;
mod program;
mod ray_scene;
mod report;
mod row;
mod serve;
mod statistics;
mod workload;

pub use args::PeersArgs;
pub use glsl::{COUNT_COMPUTE, PUSH_FRAGMENT, PUSH_VERTEX, TEXTURES_FRAGMENT, TEXTURES_VERTEX};
pub use glsl::{GlslStage, RAY_CLOSEST_HIT, RAY_GENERATION, RAY_MISS, RAY_QUERY, compile};
pub use measure::{RunOptions, run};
pub use peer::{Failure, Peer, PeerDevice, PeerEntry, RowRun, Sample};
pub use program::Program;
pub use ray_scene::{RayScene, RayView, ray_result};
pub use row::Row;
pub(crate) use statistics::format_time;
pub use workload::{UPLOAD_BYTES, Workload, texel, texture_cell, upload_bytes};

/// Returns the peers that need no other library: plain `ash`, which the others are compared with, and `lvk`, by the driver's
/// rays and by its own.
#[must_use]
pub fn own_peers() -> Vec<PeerEntry> {
    vec![ash_peer::ENTRY, lvk_peer::ENTRY, lvk_peer::SOFTWARE_ENTRY]
}
