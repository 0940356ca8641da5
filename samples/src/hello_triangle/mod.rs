//! The `hello_triangle` sample: a turning triangle by the rasteriser, the smallest whole sample. `renderer.rs` is all of what
//! it does with `lvk`. Its three corners are placed in the picture itself, so there is no camera that a window could move.
//!
//! [`HelloTriangle`] is the sample for programs and tests, `info.rs` describes its program.

mod info;
mod renderer;

pub use renderer::HelloTriangle;
