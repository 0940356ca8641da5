//! Acceleration acceleration structures: builds, reordering, splits, updates, compaction, serialization, errors and leaks.

mod batches;
mod blas_relocation;
mod compaction;
mod compaction_budgets;
mod errors;
mod leaks;
mod many_geometries;
mod opacity_micromaps;
mod out_of_order_tlas_updates;
mod primitive_order;
mod serialize;
mod split;
mod split_updates;
mod swiftshader;
mod updates;
