//! The `large_scene` sample: millions of triangles, from several OBJ files or from code, as one mesh or as instances of the
//! originals. The library splits what is too large for the device; structures are compacted, and kept on disk so that the
//! next start builds none.
//!
//! [`LargeScene`] is the sample for programs and tests, [`World`] what it shows, `info.rs` describes its program.

mod config;
mod figures;
mod gpu_world;
mod info;
mod load;
mod merge;
mod pipelines;
mod renderer;
mod street;
mod structure_cache;
mod structures;
mod world;

pub use config::{LargeSceneConfig, Show};
pub use figures::{Figures, Origin, StructureFigures};
pub use info::LargeSceneArgs;
pub use renderer::LargeScene;
pub use world::{Instance, Piece, World};
