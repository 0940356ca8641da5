//! The model: all that a file holds.

use crate::{Animation, Camera, Image, Light, Material, Mesh, Node, Sampler, Skin, Warning};

/// The content of a glTF file.
///
/// References are indices into these lists. The loader checks each of them, so that those of a loaded model are in range.
/// The indices of nodes, meshes, materials, skins, cameras, lights, scenes and animations are those of the file. Those of
/// images and samplers are not: see [`Model::images`] and [`Model::samplers`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Model {
    /// Scenes. May be empty: then the file is a library of objects.
    pub scenes: Vec<Scene>,
    /// The scene to show first, as an index into `scenes`. The first scene if the file names none.
    pub default_scene: Option<usize>,
    /// Nodes of all scenes. They form trees: no node has two parents, and none is its own ancestor.
    pub nodes: Vec<Node>,
    /// Meshes.
    pub meshes: Vec<Mesh>,
    /// Materials. A primitive without one has `Material::default()`.
    pub materials: Vec<Material>,
    /// Images that materials use. An image that is used both as colour and as data is listed twice, once for each
    /// [`ColorSpace`](crate::ColorSpace), and both share the texels. Images that no material uses are left out.
    pub images: Vec<Image>,
    /// Samplers of textures. The last one is the default sampler if a texture names none.
    pub samplers: Vec<Sampler>,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Lights of `KHR_lights_punctual`.
    pub lights: Vec<Light>,
    /// Skins.
    pub skins: Vec<Skin>,
    /// Animations.
    pub animations: Vec<Animation>,
    /// What the file has and the model leaves out, or replaces.
    pub warnings: Vec<Warning>,
}

/// A set of node trees that are shown together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Name in the file.
    pub name: Option<String>,
    /// Roots of the trees, as indices into [`Model::nodes`].
    pub roots: Vec<usize>,
}

impl Model {
    /// Returns the nodes of a scene, every parent before its children. An unknown scene has none.
    #[must_use]
    pub fn scene_nodes(&self, scene: usize) -> Vec<usize> {
        let mut order = self.scenes.get(scene).map_or(Vec::new(), |scene| scene.roots.clone());
        let mut next = 0;
        while let Some(node) = order.get(next) {
            let children = self.nodes.get(*node).map_or(&[][..], |node| &node.children);
            let left = self.nodes.len().saturating_sub(order.len()); // a circle, which only a caller can make, ends
            order.extend(children.iter().take(left));
            next += 1;
        }
        order
    }
}
