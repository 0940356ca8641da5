//! The `large_scene` sample: millions of triangles, from several OBJ files or from code, as one mesh or as instances of the
//! originals. The library splits what is too large for the device; structures are compacted, and kept on disk so that the
//! next start builds none.
//!
//! [`LargeScene`] is the sample for programs and tests, [`World`] what it shows, [`run`] the one for the command line.

mod args;
mod config;
mod error;
mod figures;
mod gpu_world;
mod load;
mod merge;
mod pipelines;
mod renderer;
mod run;
mod street;
mod structure_cache;
mod structures;
mod world;

pub use args::LargeSceneArgs;
pub use config::{LargeSceneConfig, Show};
pub use error::LargeSceneError;
pub use figures::{Figures, Origin, StructureFigures};
pub use pipelines::pipelines;
pub use renderer::LargeScene;
pub use run::run;
pub use world::{Instance, Piece, World};
