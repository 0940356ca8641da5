//! What moves a model, apart from what is uploaded once.

use lvk_gltf::{Mesh, Model, Primitive};

/// Returns the model without vertices, images and materials: enough for its poses, placements, cameras and lights.
pub(crate) fn rig(model: Model) -> Model {
    let mesh = |mesh: Mesh| Mesh { primitives: Vec::new(), ..mesh };
    Model {
        meshes: model.meshes.into_iter().map(mesh).collect(),
        materials: Vec::new(),
        images: Vec::new(),
        samplers: Vec::new(),
        warnings: Vec::new(),
        ..model
    }
}

/// True if joints or morph targets move the vertices of a node's mesh, in some pose.
pub(crate) fn deforms(model: &Model, node: usize) -> bool {
    let Some(node_data) = model.nodes.get(node) else { return false };
    let Some(mesh) = node_data.mesh.and_then(|mesh| model.meshes.get(mesh)) else { return false };
    let any = |is: fn(&Primitive) -> bool| mesh.primitives.iter().any(is);
    let joints = node_data.skin.and_then(|skin| model.skins.get(skin)).map_or(0, |skin| skin.joints.len());
    let weights = if node_data.weights.is_empty() { &mesh.weights } else { &node_data.weights };
    let are_weights_moved = || {
        let channels = model.animations.iter().flat_map(|animation| &animation.channels);
        let mut of_node = channels.filter(|channel| channel.node == node);
        of_node.any(|channel| channel.path == lvk_gltf::ChannelPath::Weights)
    };
    let is_skinned = joints > 0 && any(|primitive| !primitive.joints.is_empty());
    let is_morphed = any(|primitive| !primitive.morph_targets.is_empty())
        && (weights.iter().any(|weight| *weight != 0.0) || are_weights_moved());
    is_skinned || is_morphed
}
