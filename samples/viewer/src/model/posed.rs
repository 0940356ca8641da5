//! A model as it stands at a time of an animation.

use glam::{Mat3, Mat4, Vec3};
use lvk_gltf::{Mesh, Model, Pose, Positions, Primitive, Transform};

/// Returns a model whose default scene is `model`'s at a time of an animation, without anything left to move: nodes have no
/// parents, and meshes with skins or morph targets have the vertices of that time. Without an animation nodes stand as the file
/// says.
#[must_use]
pub fn posed(mut model: Model, animation: Option<usize>, seconds: f32) -> Model {
    let pose = model.pose(animation, seconds);
    let scene = model.default_scene.unwrap_or(0);
    let shown = model.scene_nodes(scene);
    for &node in &shown {
        if let Some(mesh) = moved_mesh(&model, node, &pose) {
            model.meshes.push(mesh);
            model.nodes[node].mesh = Some(model.meshes.len() - 1);
        }
        let is_skinned = model.nodes[node].skin.take().is_some();
        let world = pose.world.get(node).copied().unwrap_or_default();
        let target = &mut model.nodes[node];
        target.transform = Transform::Matrix(if is_skinned { Mat4::IDENTITY } else { world });
        (target.parent, target.weights) = (None, Vec::new());
        target.children.clear();
    }
    if let Some(scene) = model.scenes.get_mut(scene) {
        scene.roots = shown;
    }
    (model.animations, model.skins) = (Vec::new(), Vec::new());
    model
}

/// The mesh of a node with the vertices of a pose, if joints or morph targets move them.
fn moved_mesh(model: &Model, node: usize, pose: &Pose) -> Option<Mesh> {
    let node_data = &model.nodes[node];
    let mesh = model.meshes.get(node_data.mesh?)?;
    let (weights, joints) = movers(model, node, pose);
    let is_moved = !joints.is_empty() || weights.iter().any(|weight| *weight != 0.0);
    is_moved.then(|| Mesh {
        primitives: mesh.primitives.iter().map(|primitive| moved(primitive, weights, joints)).collect(),
        name: mesh.name.clone(),
        weights: Vec::new(),
    })
}

/// The weights of morph targets and the matrices of joints that move the vertices of a node's mesh.
pub(crate) fn movers<'a>(model: &Model, node: usize, pose: &'a Pose) -> (&'a [f32], &'a [Mat4]) {
    let weights = pose.weights.get(node).map_or(&[][..], Vec::as_slice);
    let skin = model.nodes.get(node).and_then(|node| node.skin);
    (weights, skin.and_then(|skin| pose.joints.get(skin)).map_or(&[][..], Vec::as_slice))
}

/// The triangles with their vertices where morph targets and joints move them.
pub(crate) fn moved(primitive: &Primitive, weights: &[f32], joints: &[Mat4]) -> Primitive {
    let vertices = 0..primitive.vertex_count();
    let turned = |vertex: usize, direction: Vec3| {
        let matrix = primitive.skin_matrix(vertex, joints).map_or(Mat3::IDENTITY, Mat3::from_mat4);
        // Normals of a stretched mesh lean otherwise; a flat one has no inverse.
        let normals = if matrix.determinant().abs() > 1e-20 { matrix.inverse().transpose() } else { matrix };
        (normals * direction).try_normalize().unwrap_or(direction)
    };
    let normal = |vertex: usize| {
        let own = primitive.normals.get(vertex).copied().unwrap_or([0.0, 0.0, 1.0]);
        let targets = primitive.morph_targets.iter().zip(weights);
        let sum = targets.fold(Vec3::from(own), |sum, (target, weight)| {
            sum + *weight * Vec3::from(target.normals.get(vertex).copied().unwrap_or_default())
        });
        turned(vertex, sum).to_array()
    };
    let tangent = |(vertex, [x, y, z, side]): (usize, &[f32; 4])| {
        let matrix = primitive.skin_matrix(vertex, joints).unwrap_or(Mat4::IDENTITY);
        let targets = primitive.morph_targets.iter().zip(weights);
        let sum = targets.fold(Vec3::new(*x, *y, *z), |sum, (target, weight)| {
            sum + *weight * Vec3::from(target.tangents.get(vertex).copied().unwrap_or_default())
        });
        let along = matrix.transform_vector3(sum).try_normalize().unwrap_or(Vec3::X);
        [along.x, along.y, along.z, *side]
    };
    Primitive {
        positions: Positions::F32(
            vertices
                .clone()
                .map(|vertex| primitive.position_at(vertex, weights, joints).to_array())
                .collect(),
        ),
        normals: vertices.map(normal).collect(),
        tangents: primitive.tangents.iter().enumerate().map(tangent).collect(),
        joints: Vec::new(),
        weights: Vec::new(),
        morph_targets: Vec::new(),
        ..primitive.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lvk_gltf::{MorphTarget, Node, Skin, Trs};

    /// A triangle whose only joint, a child of another node, is two units up and turned by a quarter.
    fn skinned() -> Model {
        let turn = glam::Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        let joint = Trs { translation: Vec3::new(0.0, 2.0, 0.0), rotation: turn, scale: Vec3::ONE };
        let primitive = Primitive {
            positions: Positions::F32(vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]]),
            normals: vec![[1.0, 0.0, 0.0]; 3],
            joints: vec![vec![[0; 4]; 3]],
            weights: vec![vec![[1.0, 0.0, 0.0, 0.0]; 3]],
            indices: vec![0, 1, 2],
            morph_targets: vec![MorphTarget {
                positions: vec![[0.0, 0.0, 3.0]; 3],
                ..MorphTarget::default()
            }],
            ..Primitive::default()
        };
        Model {
            nodes: vec![
                Node { children: vec![1], ..Node::default() },
                Node { parent: Some(0), transform: Transform::Trs(joint), ..Node::default() },
                Node { mesh: Some(0), skin: Some(0), weights: vec![0.5], ..Node::default() },
            ],
            meshes: vec![Mesh { primitives: vec![primitive], ..Mesh::default() }],
            skins: vec![Skin {
                joints: vec![1],
                inverse_bind_matrices: vec![Mat4::IDENTITY],
                ..Skin::default()
            }],
            scenes: vec![lvk_gltf::Scene { name: None, roots: vec![0, 2] }],
            default_scene: Some(0),
            ..Model::default()
        }
    }

    #[test]
    fn joints_and_morph_targets_move_vertices_and_normals() {
        let model = posed(skinned(), None, 0.0);
        let placements = model.placements(0, &model.pose(None, 0.0));
        assert_eq!(placements.len(), 1);
        assert_eq!(placements[0].transform, Mat4::IDENTITY);
        let part = &model.meshes[placements[0].mesh].primitives[0];
        let first = Vec3::from(part.positions.get(0).unwrap());
        assert!(first.distance(Vec3::new(0.0, 3.0, 1.5)) < 1e-5, "{first}");
        assert!(Vec3::from(part.normals[0]).distance(Vec3::Y) < 1e-5);
    }

    #[test]
    fn nodes_keep_their_places_without_parents() {
        let mut model = skinned();
        let child = Trs { translation: Vec3::X, ..Trs::IDENTITY };
        model.nodes.push(Node {
            parent: Some(1),
            mesh: Some(0),
            transform: Transform::Trs(child),
            ..Node::default()
        });
        model.nodes[1].children.push(3);
        let before = model.pose(None, 0.0).world[3];
        let model = posed(model, None, 0.0);
        assert!(model.nodes.iter().all(|node| node.parent.is_none() && node.children.is_empty()));
        assert!(model.pose(None, 0.0).world[3].abs_diff_eq(before, 1e-6));
        assert_eq!(model.scenes[0].roots.len(), 4);
    }
}
