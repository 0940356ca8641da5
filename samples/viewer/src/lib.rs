//! The `viewer` sample: shows models of glTF and OBJ files, by an unbiased path tracer or by a
//! real-time method.
//!
//! [`Viewer`] is the sample for programs and tests, `viewer_sample.rs` what it does in each frame, `info.rs` describes its program and
//! `open.rs` opens what the arguments name. [`model`] loads models or makes the one that needs no file, [`light`] makes the sky and the
//! sun, [`city`] writes a large model for measurements, `gpu` uploads both and moves what an animation moves, `path_tracer.rs` traces paths and `hybrid` is the real-time method.
#![cfg_attr(
    not(feature = "window"),
    allow(
        dead_code,
        reason = "panels of windows alone read some fields; builds with windows find what nothing reads"
    )
)]

mod args;
pub mod city;
mod config;
mod dropped;
mod gpu;
mod hybrid;
mod info;
mod launch;
pub mod light;
pub mod model;
mod names;
mod open;
#[cfg(feature = "window")]
mod panel;
mod path_pass;
mod pipelines;
mod playback;
mod present;
mod renderer;
mod viewer;
mod viewer_sample;

pub use args::{LightArgs, SkyArg, ViewerArgs};
pub use config::{
    Content, CullingMode, IndirectLight, LightRate, Method, PrimaryVisibility, ToneMapping, ViewerConfig,
};
pub use gpu::{DrawnInstances, TextureMemory};
pub use viewer::{PreparationTimes, Viewer, ViewerScene};
