//! Transforms, joint matrices and weights of a model at a time of an animation.

use glam::{Mat4, Vec3};

use crate::{Bounds, Model, Node, Primitive, Skin, Transform, Trs};

/// A model at a time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    /// Transform of each node to the space of the scene.
    pub world: Vec<Mat4>,
    /// Weights of morph targets of each node; empty for a node without them.
    pub weights: Vec<Vec<f32>>,
    /// Matrices of each joint of each skin, from the space of the mesh to that of the scene.
    pub joints: Vec<Vec<Mat4>>,
}

/// A mesh that is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// The node, as an index into [`Model::nodes`].
    pub node: usize,
    /// The mesh, as an index into [`Model::meshes`].
    pub mesh: usize,
    /// The skin, whose joint matrices take the place of `transform`.
    pub skin: Option<usize>,
    /// Transform from the mesh to the scene. The identity for a mesh with a skin. Where its determinant is negative, triangles
    /// are clockwise seen from the front.
    pub transform: Mat4,
}

impl Model {
    /// Returns the model at a time of an animation, or as the nodes say without one. Before its first keyframe a channel
    /// has the first value, after its last one the last value.
    #[must_use]
    pub fn pose(&self, animation: Option<usize>, seconds: f32) -> Pose {
        let mut locals: Vec<Transform> = self.nodes.iter().map(|node| node.transform).collect();
        let mut weights: Vec<Vec<f32>> = self.nodes.iter().map(|node| self.weights_of(node)).collect();
        if let Some(animation) = animation.and_then(|index| self.animations.get(index)) {
            animation.apply(seconds, &mut locals, &mut weights);
        }
        let world = self.world_transforms(&locals);
        let joints = self.skins.iter().map(|skin| joint_matrices(skin, &world)).collect();
        Pose { world, weights, joints }
    }

    /// Returns the meshes that a scene shows, one for each instance. Instances of a mesh with a skin are left out.
    #[must_use]
    pub fn placements(&self, scene: usize, pose: &Pose) -> Vec<Placement> {
        self.scene_nodes(scene).into_iter().flat_map(|node| self.placements_of(node, pose)).collect()
    }

    /// Returns the box around the vertices of a scene, skinned and morphed, or `None` if it shows none.
    /// Meshes without skin are enclosed by the corners of their own box.
    #[must_use]
    pub fn bounds(&self, scene: usize, pose: &Pose) -> Option<Bounds> {
        let mut at_rest: Vec<Option<Vec<Bounds>>> = vec![None; self.meshes.len()];
        let around = |placement: Placement| self.placement_bounds(&placement, pose, &mut at_rest);
        self.placements(scene, pose).into_iter().filter_map(around).reduce(Bounds::union)
    }

    fn weights_of(&self, node: &Node) -> Vec<f32> {
        let mesh = node.mesh.and_then(|mesh| self.meshes.get(mesh));
        if node.weights.is_empty() {
            mesh.map_or(Vec::new(), |mesh| mesh.weights.clone())
        } else {
            node.weights.clone()
        }
    }

    /// Multiplies the transforms of all ancestors, roots first.
    fn world_transforms(&self, locals: &[Transform]) -> Vec<Mat4> {
        let mut world: Vec<Mat4> = locals.iter().map(Transform::matrix).collect();
        let roots = (0..self.nodes.len()).filter(|node| self.nodes[*node].parent.is_none());
        let mut open: Vec<usize> = roots.collect();
        while let Some(node) = open.pop() {
            for child in &self.nodes[node].children {
                if let Some(local) = world.get(*child) {
                    world[*child] = world[node] * *local;
                    open.push(*child);
                }
            }
        }
        world
    }

    fn placements_of(&self, index: usize, pose: &Pose) -> Vec<Placement> {
        let Some((node, world)) = self.nodes.get(index).zip(pose.world.get(index)) else { return Vec::new() };
        let Some(mesh) = node.mesh else { return Vec::new() };
        let placement = |transform| Placement { node: index, mesh, skin: node.skin, transform };
        match &node.instances {
            _ if node.skin.is_some() => vec![placement(Mat4::IDENTITY)],
            Some(instances) => instances.iter().map(|trs: &Trs| placement(*world * trs.matrix())).collect(),
            None => vec![placement(*world)],
        }
    }

    /// `at_rest` keeps the boxes of the primitives of meshes whose vertices nothing moves.
    fn placement_bounds(
        &self,
        placement: &Placement,
        pose: &Pose,
        at_rest: &mut [Option<Vec<Bounds>>],
    ) -> Option<Bounds> {
        let weights = pose.weights.get(placement.node).map_or(&[][..], |weights| weights);
        let joints = placement.skin.and_then(|skin| pose.joints.get(skin)).map_or(&[][..], |joints| joints);
        let primitives = &self.meshes.get(placement.mesh)?.primitives;
        let boxes = || -> Vec<Bounds> {
            let around = |primitive: &Primitive| {
                let vertices = 0..primitive.vertex_count();
                Bounds::around(vertices.map(|vertex| primitive.position_at(vertex, weights, joints)))
            };
            primitives.iter().filter_map(around).collect()
        };
        let moved;
        let boxes = match at_rest.get_mut(placement.mesh) {
            Some(known) if joints.is_empty() && weights.iter().all(|weight| *weight == 0.0) => {
                known.get_or_insert_with(boxes)
            }
            _ => {
                moved = boxes();
                &moved
            }
        };
        boxes.iter().map(|bounds| bounds.transformed(&placement.transform)).reduce(Bounds::union)
    }
}

impl Primitive {
    /// Returns the position of a vertex with morph targets of these weights and the joints of a skin; without joints in
    /// the space of the mesh, with joints in that of the scene. A vertex out of range is at the origin.
    #[must_use]
    pub fn position_at(&self, vertex: usize, weights: &[f32], joints: &[Mat4]) -> Vec3 {
        let mut position = Vec3::from(self.positions.get(vertex).unwrap_or_default());
        for (target, weight) in self.morph_targets.iter().zip(weights) {
            position += *weight * Vec3::from(target.positions.get(vertex).copied().unwrap_or_default());
        }
        self.skin_matrix(vertex, joints).map_or(position, |matrix| matrix.transform_point3(position))
    }

    /// Returns the matrix that moves a vertex with the joints of a skin, or `None` if there are no joints.
    #[must_use]
    pub fn skin_matrix(&self, vertex: usize, joints: &[Mat4]) -> Option<Mat4> {
        if joints.is_empty() || self.joints.is_empty() {
            return None;
        }
        let mut matrix = Mat4::ZERO;
        for (set, weights) in self.joints.iter().zip(&self.weights) {
            for (joint, weight) in set.get(vertex)?.iter().zip(weights.get(vertex)?) {
                matrix += joints.get(usize::from(*joint)).copied().unwrap_or_default() * *weight;
            }
        }
        Some(matrix)
    }
}

fn joint_matrices(skin: &Skin, world: &[Mat4]) -> Vec<Mat4> {
    let pairs = skin.joints.iter().zip(&skin.inverse_bind_matrices);
    pairs.map(|(joint, inverse)| world.get(*joint).copied().unwrap_or_default() * *inverse).collect()
}
