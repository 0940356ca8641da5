//! Skins.

use glam::Mat4;

/// A skin: nodes that move the vertices of a mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skin {
    /// Name in the file.
    pub name: Option<String>,
    /// Joints, as indices into [`Model::nodes`](crate::Model::nodes).
    pub joints: Vec<usize>,
    /// Matrices from the space of the mesh to that of each joint. As many as joints; identities if the file has none.
    pub inverse_bind_matrices: Vec<Mat4>,
    /// The root of the joints, if the file names it.
    pub skeleton: Option<usize>,
}
