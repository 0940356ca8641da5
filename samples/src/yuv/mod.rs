//! The `yuv` sample: a moving picture in Y'CbCr, made by code, as decoders give it out: two or three planes of 8 or 10 bits, whose
//! colour differences have half the size. Shaders sample it as colours, by the conversion that its texture was made with, and
//! its planes one by one. The picture is flat and fills the canvas, so there is no camera that a window could move.
//!
//! [`Yuv`] is the sample for programs and tests, `info.rs` describes its program.

mod config;
mod encode;
mod info;
mod pipelines;
mod renderer;
mod synthetic_video;
mod video_texture;

pub use config::{CONVERSIONS, YuvConfig, YuvFormat, YuvModel, YuvRange};
pub use info::YuvArgs;
pub use renderer::Yuv;
pub use synthetic_video::SyntheticVideo;
