//! A model on the GPU.

mod albedo_table;
mod geometry;
pub(crate) mod layout;
mod lights;
mod materials;
mod scene;
mod textures;
mod vertices;

pub(crate) use scene::{Draw, GpuScene};
