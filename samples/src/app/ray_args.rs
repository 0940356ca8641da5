//! The part of the command line that all samples share that trace rays.

use clap::{Args, ValueEnum};

/// The choice of the ray tracing path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
pub struct RayArgs {
    /// The ray tracing path
    #[arg(long, value_enum, default_value_t = RayTracing::Auto, help_heading = "Rendering")]
    pub rt: RayTracing,
}

/// The ray tracing path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RayTracing {
    /// A ray tracing pipeline if the device supports it, else ray queries; on a CPU software ray queries, the fastest.
    Auto,
    /// A ray tracing pipeline; on CPUs and on devices without them, lowered to a compute shader.
    Pipeline,
    /// Ray queries of the device in a compute shader; on devices without them, as `software`.
    Query,
    /// Software ray queries of the library, on any device.
    Software,
    /// A ray tracing pipeline of the device itself.
    Hardware,
}
