//! The `mesh_shaders` sample: a knot cut into meshlets. A task shader leaves out those that cannot be seen, a mesh shader puts
//! out the triangles of each, in a colour of its own.
//!
//! [`MeshShaders`] is the sample for programs and tests, `info.rs` describes its program.

mod counter;
mod info;
mod knot;
mod meshlets;
mod pipelines;
mod renderer;

pub use crate::shapes::GpuVertex;
pub use info::MeshShadersArgs;
pub use meshlets::{Meshlet, Meshlets};
pub use renderer::MeshShaders;
