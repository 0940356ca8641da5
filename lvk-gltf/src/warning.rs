//! What a file has and a model leaves out.

use std::fmt;

/// What a file has and the model leaves out, or replaces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Warning {
    /// The file uses an extension that the loader does not know. The file does not require it.
    ExtensionIgnored {
        /// Name of the extension.
        extension: String,
    },
    /// An object has an extension or a feature that the model has no place for.
    FeatureIgnored {
        /// The object, such as `mesh 3 'Body', primitive 1`.
        place: String,
        /// The extension or feature, such as `attribute _TEMPERATURE`.
        feature: String,
    },
    /// A primitive consists of points or lines, and is left out.
    NoTriangles {
        /// The primitive.
        place: String,
        /// The file's word: `POINTS`, `LINES`, `LINE_LOOP` or `LINE_STRIP`.
        mode: &'static str,
    },
    /// A primitive has neither positions nor an extension that gives them, and is left out.
    NoPositions {
        /// The primitive.
        place: String,
    },
    /// The triangles of a primitive that is not a whole number of triangles; the last vertices are left out.
    IncompleteTriangle {
        /// The primitive.
        place: String,
    },
    /// The material of a primitive has a texture, and the primitive lacks its set of texture coordinates. Renderers read the
    /// texture at `(0, 0)`.
    NoTexCoords {
        /// The primitive.
        place: String,
        /// Name of the texture in the material, such as `baseColorTexture`.
        texture: &'static str,
        /// The set.
        set: usize,
    },
    /// A texture or an image cannot be used, and is left out or replaced by another one that the file names.
    ImageIgnored {
        /// The image or texture.
        place: String,
        /// The reason, and what takes its place.
        reason: String,
    },
    /// Values break a rule of the format, and are corrected.
    Corrected {
        /// The object.
        place: String,
        /// What was corrected, such as `weights of joints that do not sum up to 1`.
        what: String,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ExtensionIgnored { extension } => write!(f, "the extension {extension} is ignored"),
            Self::FeatureIgnored { place, feature } => write!(f, "{place}: {feature} is ignored"),
            Self::NoTriangles { place, mode } => {
                write!(f, "{place}: {mode} are left out; only triangles are shown")
            }
            Self::NoPositions { place } => write!(f, "{place}: left out, as it has no positions"),
            Self::IncompleteTriangle { place } => {
                write!(f, "{place}: the last triangle is incomplete and left out")
            }
            Self::NoTexCoords { place, texture, set } => {
                write!(f, "{place}: it has no TEXCOORD_{set} for the {texture} of its material")
            }
            Self::ImageIgnored { place, reason } => write!(f, "{place}: {reason}"),
            Self::Corrected { place, what } => write!(f, "{place}: corrected {what}"),
        }
    }
}
