//! Nodes and their transforms.

use glam::{Mat4, Quat, Vec3};

/// A node of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Node {
    /// Name in the file.
    pub name: Option<String>,
    /// The parent, or `None` for a root.
    pub parent: Option<usize>,
    /// Children.
    pub children: Vec<usize>,
    /// Transform to the space of the parent.
    pub transform: Transform,
    /// The mesh, as an index into [`Model::meshes`](crate::Model::meshes).
    pub mesh: Option<usize>,
    /// The skin of the mesh. Vertices of a skinned mesh take the place that the joints give them, whatever the
    /// transform of this node.
    pub skin: Option<usize>,
    /// The camera. It looks along -Z, with +Y up.
    pub camera: Option<usize>,
    /// The light. Directional lights and spots shine along -Z.
    pub light: Option<usize>,
    /// Weights of the mesh's morph targets. If empty, those of the mesh hold.
    pub weights: Vec<f32>,
    /// Transforms of `EXT_mesh_gpu_instancing`, from the mesh to the space of this node: the mesh is shown once for each
    /// of them. `None` shows it once.
    pub instances: Option<Vec<Trs>>,
}

/// A transform to the space of the parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    /// Translation, rotation and scale. Animations play only these.
    Trs(Trs),
    /// A matrix, whose last row is 0, 0, 0, 1.
    Matrix(Mat4),
}

/// Translation, rotation and scale: first the scale, then the rotation, then the translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trs {
    /// Translation, metres.
    pub translation: Vec3,
    /// Rotation, of unit length.
    pub rotation: Quat,
    /// Scale of each axis. May be negative or zero.
    pub scale: Vec3,
}

impl Transform {
    /// Returns the matrix of the transform.
    #[must_use]
    pub fn matrix(&self) -> Mat4 {
        match self {
            Self::Trs(trs) => trs.matrix(),
            Self::Matrix(matrix) => *matrix,
        }
    }
}

impl Default for Transform {
    fn default() -> Self {
        Self::Trs(Trs::default())
    }
}

impl Trs {
    /// The transform that changes nothing.
    pub const IDENTITY: Self = Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// Returns the matrix of the transform.
    #[must_use]
    pub fn matrix(&self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

impl Default for Trs {
    fn default() -> Self {
        Self::IDENTITY
    }
}
