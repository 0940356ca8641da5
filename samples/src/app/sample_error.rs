//! Errors of a sample.

use std::path::PathBuf;

use lvk::{Capabilities, Context};

use super::interrupt;
use super::loading::Stopped;

/// Errors of a sample.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// `lvk` reported an error.
    #[error(transparent)]
    Device(#[from] lvk::Error),
    /// Loading was stopped before the sample was ready.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The image has no pixels, or more than the device supports.
    #[error("a picture of {width}x{height} pixels is not possible: each side must be 1 to {limit}")]
    BadSize {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Most pixels a side.
        limit: u32,
    },
    /// The supersampled image has no samples, or more than the device supports.
    #[error(
        "a picture of {width}x{height} pixels with {supersampling}x{supersampling} samples each is not possible: each \
         side must have 1 to {limit} samples"
    )]
    BadSampleCount {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Samples a pixel along each side.
        supersampling: u32,
        /// Most samples along a side of the image.
        limit: u32,
    },
    /// A setting is outside of its range.
    #[error("{setting} is {value}, but must be {min} to {max}")]
    OutOfRange {
        /// Name of the setting.
        setting: &'static str,
        /// Value of the setting.
        value: u32,
        /// Smallest value.
        min: u32,
        /// Largest value.
        max: u32,
    },
    /// The device lacks a feature that the sample, or one of its options, needs.
    #[error("{device} has no {what}; {remedy}")]
    Missing {
        /// Name of the device.
        device: String,
        /// The missing feature.
        what: &'static str,
        /// The remedy for the user.
        remedy: &'static str,
    },
    /// The device cannot trace rays.
    #[error(
        "{device} has neither ray tracing pipelines nor ray queries{reason}; choose another one with --device"
    )]
    NoRayTracing {
        /// Name of the device.
        device: String,
        /// The reason, in brackets, where it is known; else empty.
        reason: String,
    },
    /// The device traces rays, but not by the path that was asked for.
    #[error("{device} has no {lacks}; use --rt {instead}")]
    PathMissing {
        /// Name of the device.
        device: String,
        /// The missing feature.
        lacks: &'static str,
        /// The value of `--rt` that works.
        instead: &'static str,
    },
    /// The hardware rasteriser of `hybrid` needs primitive ids in fragment shaders.
    #[error(
        "{device} cannot number triangles in fragment shaders (geometryShader); use --raster compute or --method standalone"
    )]
    NoPrimitiveId {
        /// Name of the device.
        device: String,
    },
    /// The hybrid method needs one of two features to find visible triangles.
    #[error(
        "{device} has neither 64-bit atomics (shaderInt64, shaderBufferInt64Atomics) nor triangle numbers in fragment shaders (geometryShader); use --method standalone"
    )]
    NoRasteriser {
        /// Name of the device.
        device: String,
    },
    /// Pixels cannot be ordered before their triangles are known.
    #[error(
        "--bounces first needs --method hybrid with --gbuffer visibility; use --bounces inline or queued"
    )]
    NothingFirst,
    /// A scene made by hand breaks the invariants of [`Scene`](crate::scene::Scene), or lacks what the sample is about.
    #[error("the scene cannot be drawn: {0}")]
    BrokenScene(&'static str),
    /// The scene has more opaque triangles than an instance's custom index counts.
    #[error("the scene has {count} opaque triangles; this sample takes fewer than {limit}")]
    TooManyTriangles {
        /// Opaque triangles.
        count: u32,
        /// The first count that does not fit.
        limit: u32,
    },
    /// The scene has more textures than the device has descriptor slots.
    #[error(
        "the scene has {count} textures, but the device has room for {limit}; use fewer, or another --device"
    )]
    TooManyTextures {
        /// Textures of the scene.
        count: usize,
        /// The largest count that fits.
        limit: u32,
    },
    /// The image has more fragments of glass than a 32-bit counter holds.
    #[error(
        "{samples} samples seen through {spheres} spheres of glass are more than can be counted; make the picture smaller"
    )]
    TooManyFragments {
        /// Samples of the image.
        samples: u64,
        /// Spheres of glass.
        spheres: usize,
    },
    /// The combined mesh of `large_scene` has too many triangles.
    #[error(
        "{count} triangles are more than the {limit} that this sample puts into one mesh; use --layout instanced, fewer \
         --copies or fewer --triangles"
    )]
    MeshTooLarge {
        /// Triangles of the mesh.
        count: u64,
        /// Most triangles.
        limit: u64,
    },
    /// A street has no scene to show.
    #[error("there is no scene to show; name an OBJ file with --scene")]
    NoScenes,
    /// The folder holds no scenes.
    #[error(
        "no OBJ file in {}; unpack the scenes there (tar -xJf NAME.tar.xz), or name another folder",
        lvk::readable_name(folder)
    )]
    EmptyFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// No folder of scenes was named.
    #[error("--archive needs a folder of OBJ files: name one behind it, or in LVK_SCENES")]
    NoFolder,
}

impl SampleError {
    /// Fails with [`SampleError::Missing`] unless the device `has` the feature `what`.
    ///
    /// # Errors
    /// [`SampleError::Missing`].
    pub fn require(has: bool, ctx: &Context, what: &'static str, remedy: &'static str) -> Result<(), Self> {
        let device = || ctx.capabilities().device_name.clone();
        if has { Ok(()) } else { Err(Self::Missing { device: device(), what, remedy }) }
    }

    /// Fails with [`SampleError::BadSize`] unless the device has 2D images of this size.
    ///
    /// # Errors
    /// [`SampleError::BadSize`].
    pub fn check_size([width, height]: [u32; 2], capabilities: &Capabilities) -> Result<(), Self> {
        let limit = capabilities.limits.max_texture_2d;
        let is_possible = |side| (1..=limit).contains(&side);
        match is_possible(width) && is_possible(height) {
            true => Ok(()),
            false => Err(Self::BadSize { width, height, limit }),
        }
    }

    /// Fails with [`SampleError::OutOfRange`] unless `value` is `min` to `max`.
    ///
    /// # Errors
    /// [`SampleError::OutOfRange`].
    pub fn check_range(setting: &'static str, value: u32, [min, max]: [u32; 2]) -> Result<(), Self> {
        match (min..=max).contains(&value) {
            true => Ok(()),
            false => Err(Self::OutOfRange { setting, value, min, max }),
        }
    }

    /// Returns the exit status of the program: 1 for trouble with the device, 130 where loading was stopped, else 2.
    #[must_use]
    pub fn status(&self) -> u8 {
        match self {
            Self::Device(_) | Self::Missing { .. } => 1,
            Self::NoRayTracing { .. } | Self::PathMissing { .. } => 1,
            Self::NoPrimitiveId { .. } | Self::NoRasteriser { .. } => 1,
            Self::Stopped(_) => interrupt::STATUS,
            _ => 2,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::run_error::RunError;

    #[test]
    fn programs_tell_wrong_input_from_devices_that_cannot() {
        let size = SampleError::BadSize { width: 0, height: 1, limit: 2 };
        let missing = SampleError::Missing { device: "Toy".to_owned(), what: "wings", remedy: "walk" };
        assert_eq!(missing.to_string(), "Toy has no wings; walk");
        assert_eq!([size, missing].map(|error| RunError::from(error).status()), [2, 1]);
    }
}
