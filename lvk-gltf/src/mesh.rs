//! Meshes: lists of triangles with attributes of their vertices.

use crate::Positions;

/// A mesh: primitives that are shown together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Name in the file.
    pub name: Option<String>,
    /// Primitives. Those of points and of lines are left out, with a warning.
    pub primitives: Vec<Primitive>,
    /// Weights of the morph targets that hold unless a node or an animation gives others. As many as the primitives
    /// have morph targets.
    pub weights: Vec<f32>,
}

/// Triangles of one material.
///
/// Each list of an attribute is empty, or has one entry for each vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Primitive {
    /// Positions of the vertices, in the format of the file.
    pub positions: Positions,
    /// Unit normals; one for each vertex. Where the file has none, those of the triangles, and then no two triangles
    /// share a vertex.
    pub normals: Vec<[f32; 3]>,
    /// Unit tangents and, fourth, the sign of the bitangent `cross(normal, tangent) * sign`, which is 1 or -1. From the
    /// file, or computed by MikkTSpace where the material has a normal map or anisotropy and the primitive has texture
    /// coordinates for it. Else empty.
    pub tangents: Vec<[f32; 4]>,
    /// Sets of texture coordinates; `(0, 0)` is the upper left corner of an image.
    pub tex_coords: Vec<Vec<[f32; 2]>>,
    /// Linear colours with alpha, which multiply the base colour of the material. Empty if the file has none.
    pub colors: Vec<[f32; 4]>,
    /// Sets of four joints, as indices into [`Skin::joints`](crate::Skin::joints). Every one is in range of each skin
    /// that a node uses with the mesh.
    pub joints: Vec<Vec<[u16; 4]>>,
    /// Weights of the joints, with as many sets. Their sum over all sets is 1 for each vertex.
    pub weights: Vec<Vec<[f32; 4]>>,
    /// Three indices of vertices for each triangle, counter-clockwise seen from the front. All are in range.
    pub indices: Vec<u32>,
    /// Morph targets.
    pub morph_targets: Vec<MorphTarget>,
    /// The material, as an index into [`Model::materials`](crate::Model::materials), or `None` for the default material.
    pub material: Option<usize>,
}

/// Differences that a morph target with weight 1 adds. Each list is empty, or has one entry for each vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MorphTarget {
    /// Differences of positions, in the units of decoded positions.
    pub positions: Vec<[f32; 3]>,
    /// Differences of normals.
    pub normals: Vec<[f32; 3]>,
    /// Differences of tangents. The sign does not change.
    pub tangents: Vec<[f32; 3]>,
}

impl Primitive {
    /// Returns the number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.positions.len()
    }

    /// Returns the number of triangles.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }
}
