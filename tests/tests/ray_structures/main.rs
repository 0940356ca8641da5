//! Acceleration structures: built, ordered, split, changed, compacted and kept as bytes; what goes wrong, and what is left.

mod anywhere;
mod batches;
mod compaction;
mod errors;
mod leftovers;
mod many_geometries;
mod order;
mod rebuilt_elsewhere;
mod recorded_apart;
mod serialize;
mod split;
mod split_updates;
mod updates;
