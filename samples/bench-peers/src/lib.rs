//! The rows of `bench peers` by other libraries, each behind a feature of this crate.
//!
//! `cargo run --release -p lvk-bench-peers` measures all of them beside `lvk` and plain `ash`, whose rows are in `lvk-bench`.

#[cfg(feature = "blade")]
mod blade_peer;
#[cfg(feature = "vk-graph")]
mod vk_graph_peer;
#[cfg(feature = "wgpu")]
mod wgpu_peer;
#[cfg(any(feature = "blade", feature = "wgpu"))]
mod wgsl;

use lvk_bench::peers::{PeerEntry, own_peers};

/// Returns all peers of this build, plain `ash` first.
#[must_use]
pub fn peers() -> Vec<PeerEntry> {
    let mut all = own_peers();
    #[cfg(feature = "wgpu")]
    all.push(wgpu_peer::ENTRY);
    #[cfg(feature = "blade")]
    all.push(blade_peer::ENTRY);
    #[cfg(feature = "vk-graph")]
    all.push(vk_graph_peer::ENTRY);
    all
}
