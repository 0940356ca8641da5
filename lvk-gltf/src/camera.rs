//! Cameras.

/// A camera. Its node says where it stands: it looks along -Z, with +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: Option<String>,
    /// How the image is projected.
    pub projection: Projection,
}

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// A perspective.
    Perspective {
        /// Vertical field of view, radians, below pi.
        yfov: f32,
        /// Width over height of the image, or `None` for that of the window.
        aspect_ratio: Option<f32>,
        /// Distance of the near plane, above 0.
        znear: f32,
        /// Distance of the far plane, above `znear`, or `None` for infinity.
        zfar: Option<f32>,
    },
    /// A parallel projection.
    Orthographic {
        /// Half the width of the image, metres.
        xmag: f32,
        /// Half the height of the image, metres.
        ymag: f32,
        /// Distance of the near plane, 0 or more.
        znear: f32,
        /// Distance of the far plane, above `znear`.
        zfar: f32,
    },
}
