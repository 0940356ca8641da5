//! Samples that take long to load, in a window: a thread loads while frames show how far it is.

mod background;
#[cfg(feature = "window")]
mod overlay;
mod sample;
mod status;
mod thread;

pub use sample::Loading;
pub use status::{Status, Stopped};
pub use thread::LoadThread;
