//! The configuration of the sample.

use std::path::PathBuf;

use clap::ValueEnum;

use crate::rtx::RtxConfig;

/// The configuration of the sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LargeSceneConfig {
    /// Path and size.
    pub rtx: RtxConfig,
    /// Largest number of reflections and refractions of a ray, 0 to [`LargeSceneConfig::MAX_DEPTH`].
    pub depth: u32,
    /// Rays of each pixel, evenly spread over it: 1 to [`LargeSceneConfig::MAX_SAMPLES`].
    pub samples: u32,
    /// The quantity that pixels show.
    pub show: Show,
    /// True if bottom-level structures are compacted.
    pub compact: bool,
    /// Folder of built structures of earlier starts, if they are kept. It need not exist. Only the program itself may write
    /// there, as the device follows what the files say.
    pub cache: Option<PathBuf>,
}

/// The quantity that pixels show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Show {
    /// Sun, shadows, mirrors and glass.
    Picture,
    /// A colour for each instance.
    Instances,
    /// A colour for each triangle.
    Triangles,
}

impl LargeSceneConfig {
    /// The largest depth.
    pub const MAX_DEPTH: u32 = 16;
    /// The largest number of samples.
    pub const MAX_SAMPLES: u32 = 256;

    /// As usual but for path and size: without files.
    #[must_use]
    pub fn new(rtx: RtxConfig) -> Self {
        Self { rtx, depth: 3, samples: 4, show: Show::Picture, compact: true, cache: None }
    }

    /// Clamps the numbers to their bounds.
    pub(super) fn clamped(self) -> Self {
        let samples = self.samples.clamp(1, Self::MAX_SAMPLES);
        Self { depth: self.depth.min(Self::MAX_DEPTH), samples, ..self }
    }
}

impl Show {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Picture, Self::Instances, Self::Triangles];

    /// Returns the number of the mode in `shaders/large_scene/frame.glsl`.
    pub(super) fn number(self) -> u32 {
        self as u32
    }
}
