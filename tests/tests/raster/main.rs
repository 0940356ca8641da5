//! Rasterisation: draws of every kind, and every state of passes and pipelines.

mod blending;
mod draws;
mod egui_painter;
mod errors;
mod fast_link;
mod indirect_count;
mod layers;
mod local_read;
mod local_read_refusals;
mod mesh_shaders;
mod multisampling;
mod portability;
mod shading_rate;
mod stages;
mod state;
mod stencil;
mod vertex_formats;
