//! The `bench` program measures the costs and gains of `lvk` on the device in use. Every ratio compares two figures of the
//! same run.
//!
//! GPU times come from timestamp queries, CPU times from the host clock. Compared variants run interleaved, so that clocks and
//! temperatures are equal for all of them. Figures are medians.

mod args;
mod batch;
mod builds;
mod compaction;
mod cpu_overhead;
mod embree;
mod error;
pub mod flip;
mod growth;
mod hand_written;
mod instance_record;
mod lowered;
mod measure;
mod mesh;
mod morton;
mod order;
mod overhead;
pub mod paper;
pub mod peers;
mod pipelines;
mod queries;
mod run;
mod setup;
mod split;
mod synthetic;
mod table;
mod tlas;
mod tracer;
mod tree_rays;

pub use args::BenchArgs;
pub use cpu_overhead::CountingAllocator;
pub use pipelines::pipelines;
pub use run::run;
