//! The error type of the crate.

use std::fmt;

use egui::TextureId;

/// Result of every fallible call of the crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Errors of a painter.
#[derive(Clone, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An error of the library.
    #[error(transparent)]
    Lvk(#[from] lvk::Error),
    /// The painter has no texture of this id.
    #[error(
        "the painter has no texture {id:?}: pass every TexturesDelta of its egui context to Painter::update, and give \
         textures of the application an id by Painter::register_texture"
    )]
    UnknownTexture {
        /// The id in a mesh, or in a change of a part of a texture.
        id: TextureId,
    },
    /// A mesh has an index beyond its vertices. Shaders would read other memory.
    #[error("a mesh of {vertices} vertices has the index {index}; Mesh::is_valid finds such meshes")]
    InvalidMesh {
        /// Number of vertices of the mesh.
        vertices: usize,
        /// The first index that is too large.
        index: u32,
    },
    /// The meshes of one frame have too many vertices or indices in all.
    #[error("the meshes of a frame have {count} {what}, more than {limit}; lay out less at once")]
    TooLarge {
        /// "vertices" or "indices".
        what: &'static str,
        /// Number in all meshes.
        count: usize,
        /// The largest number.
        limit: usize,
    },
    /// The pixels of a point are zero, negative, infinite or not a number.
    #[error("{pixels_per_point} pixels per point; pass FullOutput::pixels_per_point of the frame")]
    InvalidScale {
        /// Pixels of a point.
        pixels_per_point: f32,
    },
    /// The render pass has another size than the interface was laid out for.
    #[error(
        "the interface is laid out for {size_px:?} pixels, but the targets of the pass have {extent:?}; pass their \
         extent as Screen::size_px"
    )]
    WrongExtent {
        /// Width and height that [`Painter::update`](crate::Painter::update) was told.
        size_px: [u32; 2],
        /// Width and height of the pass.
        extent: [u32; 2],
    },
    /// The format of a target does not hold colours.
    #[error(
        "the interface cannot be painted on {format:?}; take a normalised or float format with red, green and blue"
    )]
    UnsupportedTarget {
        /// Format of the target.
        format: lvk::Format,
    },
    /// A paint callback was made for another painter of egui.
    #[error("a paint callback holds no lvk_egui::Callback; make it by Callback::shape")]
    ForeignCallback,
}

impl fmt::Debug for Error {
    /// Formats the error like `Display`.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, out)
    }
}
