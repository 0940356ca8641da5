//! The `viewer` sample: shows models of glTF and OBJ files, by an unbiased path tracer.
//!
//! [`Viewer`] is the sample for programs and tests, `info.rs` describes its program. [`model`] loads models or makes the one that
//! needs no file, [`light`] makes the sky and the sun, `gpu` uploads both, `path_tracer.rs` traces.

mod args;
mod config;
mod gpu;
mod info;
pub mod light;
pub mod model;
mod path_tracer;
mod pipelines;
mod present;
mod viewer;

pub use args::{LightArgs, SkyArg, ToneArg, ViewerArgs};
pub use config::{ToneMapping, ViewerConfig};
pub use viewer::{Viewer, ViewerScene};
