//! Why the sample cannot render.

/// Why the `hybrid` sample cannot render.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HybridError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
    /// The device can trace no rays at all.
    #[error(
        "{device} has neither ray tracing pipelines nor ray queries{reason}; choose another one with --device"
    )]
    NoRayTracing {
        /// Name of the device.
        device: String,
        /// Why, in brackets, where it is known; else empty.
        reason: String,
    },
    /// The device traces rays, but not by the path that was asked for.
    #[error("{device} has no {lacks}; use --rt {instead}")]
    PathMissing {
        /// Name of the device.
        device: String,
        /// What it lacks.
        lacks: &'static str,
        /// The value of `--rt` that works.
        instead: &'static str,
    },
    /// The hardware rasteriser needs triangle numbers in fragment shaders.
    #[error(
        "{device} cannot number triangles in fragment shaders (geometryShader); use --raster compute or --method standalone"
    )]
    NoPrimitiveId {
        /// Name of the device.
        device: String,
    },
    /// The hybrid method needs one of two things to find visible triangles.
    #[error(
        "{device} has neither 64-bit atomics (shaderInt64, shaderBufferInt64Atomics) nor triangle numbers in fragment shaders (geometryShader); use --method standalone"
    )]
    NoRasteriser {
        /// Name of the device.
        device: String,
    },
    /// The picture has no pixels or more than the device takes.
    #[error("a picture of {width}x{height} pixels is not possible: each side must be 1 to {limit}")]
    BadSize {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Most pixels a side.
        limit: u32,
    },
    /// The depth limit is beyond what the shaders keep room for.
    #[error("--depth {depth} is too deep: at most {limit}")]
    TooDeep {
        /// What was asked for.
        depth: u32,
        /// The largest depth.
        limit: u32,
    },
    /// No samples, or too many.
    #[error("--samples {samples} is not possible: 1 to {limit}")]
    BadSamples {
        /// What was asked for.
        samples: u32,
        /// The largest number.
        limit: u32,
    },
    /// Pixels cannot be ordered before it is known what they show.
    #[error(
        "--bounces first needs --method hybrid with --gbuffer visibility; use --bounces inline or queued"
    )]
    NothingFirst,
    /// A scene made by hand breaks the invariants of [`Scene`](crate::scene::Scene).
    #[error("the scene cannot be drawn: {0}")]
    BrokenScene(&'static str),
    /// More opaque triangles than an instance's custom index counts.
    #[error("the scene has {count} opaque triangles; this sample takes fewer than {limit}")]
    TooManyTriangles {
        /// Opaque triangles.
        count: u32,
        /// The first count that does not fit.
        limit: u32,
    },
    /// More textures than the device has room for.
    #[error(
        "the scene has {count} textures, but the device has room for {limit}; use fewer, or another --device"
    )]
    TooManyTextures {
        /// Textures of the scene.
        count: usize,
        /// The largest count that fits.
        limit: u32,
    },
}
