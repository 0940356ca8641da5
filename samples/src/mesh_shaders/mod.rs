//! The `mesh_shaders` sample: a knot cut into meshlets. A task shader leaves out those that cannot be seen, a mesh shader puts
//! out the triangles of each, in a colour of its own.
//!
//! [`MeshShaders`] is the sample for programs and tests, [`run`] the one for the command line.

mod args;
mod counter;
mod knot;
mod meshlets;
mod pipelines;
mod renderer;
mod run;

pub use args::MeshShadersArgs;
pub use meshlets::{Meshlet, Meshlets};
pub use pipelines::pipelines;
pub use renderer::{MeshShaders, Vertex};
pub use run::run;
