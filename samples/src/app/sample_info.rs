//! The description of a sample's program. [`cli::main`](super::cli::main) makes the program from it: command line, help, device,
//! frames, images, window and exit status.
//!
//! A sample implements [`Sample`] in its `renderer.rs` and describes itself in its `info.rs`:
//!
//! ```ignore
//! use crate::app::sample_info::prelude::*;
//!
//! impl SampleInfo for Cloud {
//!     const NAME: &'static str = "cloud";
//!     const ABOUT: &'static str = "Draws a cloud, and writes pictures as PNG";
//!     const EXAMPLES: &'static str = "
//!         | a picture, by the best device
//!         --validate | with validation
//!     ";
//!     type Args = NoArgs;
//!     type Sample = Self;
//!
//!     fn pipelines() -> Vec<SamplePipeline> {
//!         vec![CLOUD.data()]
//!     }
//!
//!     fn open(_: &NoArgs, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self>, RunError> {
//!         let sample = Self::new(&setup.device(&DeviceNeeds::default())?, setup.extent())?;
//!         Ok(ReadySample::raster(sample, "a cloud"))
//!     }
//! }
//! ```
//!
//! Its main calls `cli::main::<Cloud>()`, and one line in [`catalogue`](crate::catalogue) makes it known to tests. Arguments of
//! its own are a type with `#[derive(clap::Args)]`; samples that trace rays have [`RayArgs`](super::ray_args::RayArgs) among
//! them and ask for a device by [`DeviceNeeds::tracing`](super::device::DeviceNeeds::tracing).

/// The names that a description needs.
pub mod prelude {
    pub use super::{NoArgs, SampleInfo};
    pub use crate::app::cli::{ReadySample, SampleSetup};
    pub use crate::app::device::DeviceNeeds;
    pub use crate::app::run_error::RunError;
    pub use crate::pipelines::SamplePipeline;
}

use super::cli::{ReadySample, SampleSetup};
use super::run_error::RunError;
use super::sample::Sample;
use crate::pipelines::SamplePipeline;

/// The description of a sample's program.
pub trait SampleInfo {
    /// Arguments beside [`RunArgs`](super::run_args::RunArgs), which every sample has.
    type Args: clap::Args;
    /// The type that renders.
    type Sample: Sample;

    /// Name of the program, of its images and of its folder below `shaders/`.
    const NAME: &'static str;
    /// First paragraph of the help, without its full stop.
    const ABOUT: &'static str;
    /// Further paragraphs of `--help`.
    const DETAILS: &'static str = "";
    /// Commands that `--help` shows, one a line: arguments, a vertical bar, and what the command does.
    const EXAMPLES: &'static str = "
        | a picture, by the best device
        --window --hot-reload | in a window, whose shaders can be changed meanwhile
        --validate | with validation
    ";
    /// A round of the animation, for the example of a sequence; empty where the examples have their own, or none.
    const ROUND: &'static str = "one round of the animation";
    /// Paragraphs of `--help` after the examples.
    const NOTES: &'static str = "";

    /// Returns every pipeline that the sample creates.
    fn pipelines() -> Vec<SamplePipeline>;

    /// Returns the text that the program prints instead of rendering, if the arguments ask for one, as `--list-scenes` does.
    fn listing(_args: &Self::Args) -> Option<String> {
        None
    }

    /// Opens the device and creates the sample.
    ///
    /// # Errors
    /// [`RunError`] says what the user can change, or what the device lacks.
    fn open(args: &Self::Args, setup: &mut SampleSetup<'_>) -> Result<ReadySample<Self::Sample>, RunError>;
}

/// No arguments beside [`RunArgs`](super::run_args::RunArgs).
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::Args)]
pub struct NoArgs {}
