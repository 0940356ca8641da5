//! A model that moves in each way that glTF knows.

use std::f32::consts::TAU;

use glam::{Mat4, Quat, Vec3};
use lvk_gltf::{
    Animation, Channel, ChannelPath, Interpolation, Keyframes, Mesh, Model, MorphTarget, Node, Positions,
    Primitive, Skin, Transform, Trs,
};

use crate::scenes::{Builder, colored};

/// Seconds of the animation.
pub const DURATION: f32 = 2.0;
/// Height of the tube, whose joints are half of it apart.
const HEIGHT: f32 = 1.6;
const SEGMENTS: u16 = 24;
const RINGS: u16 = 16;

/// A tube that three joints bend and a morph target bulges, a box whose node turns, flies and grows, and a floor.
pub fn moving_model() -> Model {
    let mut model = Builder::default()
        .quad(Vec3::new(-4.0, 0.0, -4.0), Vec3::Z * 8.0, Vec3::X * 8.0, colored([0.7; 3], 0.0, 0.5))
        .quad(Vec3::new(-0.3, -0.3, 0.0), Vec3::X * 0.6, Vec3::Y * 0.6, colored([0.9, 0.3, 0.2], 0.0, 0.6))
        .model();
    let carrier = model.nodes.len() - 1;
    let tube = model.nodes.len();
    model.materials.push(colored([0.3, 0.6, 0.9], 0.0, 0.4));
    let mesh =
        Mesh { primitives: vec![tube_primitive(model.materials.len() - 1)], weights: vec![0.0], name: None };
    model.meshes.push(mesh);
    model.nodes.push(Node { mesh: Some(model.meshes.len() - 1), skin: Some(0), ..Node::default() });
    let first_joint = model.nodes.len();
    for number in 0..3 {
        let height = if number == 0 { Vec3::new(-1.2, 0.0, 0.0) } else { Vec3::Y * 0.5 * HEIGHT };
        let parent = (number > 0).then(|| first_joint + number - 1);
        let children = if number < 2 { vec![first_joint + number + 1] } else { Vec::new() };
        let transform = Transform::Trs(Trs { translation: height, ..Trs::IDENTITY });
        model.nodes.push(Node { parent, children, transform, ..Node::default() });
    }
    let below = |number: usize| Mat4::from_translation(-Vec3::Y * 0.5 * HEIGHT * number as f32);
    model.skins.push(Skin {
        joints: (first_joint..first_joint + 3).collect(),
        inverse_bind_matrices: (0..3).map(below).collect(),
        ..Skin::default()
    });
    model.scenes[0].roots.extend([tube, first_joint]);
    model.animations.push(animation(carrier, tube, first_joint));
    model
}

/// Along y, with normals and tangents; joints share each ring by its height.
fn tube_primitive(material: usize) -> Primitive {
    let mut primitive = Primitive { material: Some(material), ..Primitive::default() };
    let (mut positions, mut joints, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    let mut target = MorphTarget::default();
    for ring in 0..=RINGS {
        let along = f32::from(ring) / f32::from(RINGS);
        for segment in 0..=SEGMENTS {
            let (sine, cosine) = (TAU * f32::from(segment) / f32::from(SEGMENTS)).sin_cos();
            let out = Vec3::new(cosine, 0.0, sine);
            positions.push((0.25 * out + HEIGHT * along * Vec3::Y).to_array());
            primitive.normals.push(out.to_array());
            primitive.tangents.push([-sine, 0.0, cosine, 1.0]);
            let place = 2.0 * along;
            let first = place.floor().min(1.0);
            joints.push([first as u16, first as u16 + 1, 0, 0]);
            weights.push([1.0 - (place - first), place - first, 0.0, 0.0]);
            let bulge = (std::f32::consts::PI * along).sin();
            target.positions.push((0.2 * bulge * out).to_array());
            target.normals.push([0.0, -0.4 * (std::f32::consts::PI * along).cos(), 0.0]);
        }
    }
    let row = SEGMENTS + 1;
    for (ring, segment) in (0..RINGS).flat_map(|ring| (0..SEGMENTS).map(move |segment| (ring, segment))) {
        let low = u32::from(ring * row + segment);
        let high = low + u32::from(row);
        primitive.indices.extend([low, high, low + 1, low + 1, high, high + 1]);
    }
    primitive.positions = Positions::F32(positions);
    (primitive.joints, primitive.weights, primitive.morph_targets) =
        (vec![joints], vec![weights], vec![target]);
    primitive
}

fn animation(carrier: usize, tube: usize, first_joint: usize) -> Animation {
    let bend = |angle: f32| Quat::from_rotation_z(angle).to_array();
    let tracks = [
        (carrier, ChannelPath::Translation, [[0.2, 0.6, 0.4], [1.0, 1.0, 0.2], [1.4, 0.5, -0.2]].concat()),
        (
            carrier,
            ChannelPath::Rotation,
            [0.0, 0.8, 2.0].map(|angle| Quat::from_rotation_y(angle).to_array()).concat(),
        ),
        (carrier, ChannelPath::Scale, [[1.0; 3], [1.3, 0.8, 1.0], [0.7; 3]].concat()),
        (first_joint + 1, ChannelPath::Rotation, [0.0, 0.7, -0.6].map(bend).concat()),
        (first_joint + 2, ChannelPath::Rotation, [0.0, 0.9, 0.4].map(bend).concat()),
        (tube, ChannelPath::Weights, vec![0.0, 1.0, 0.3]),
    ];
    let mut animation = Animation { name: Some("all".to_owned()), ..Animation::default() };
    for (node, path, values) in tracks {
        animation.channels.push(Channel { node, path, keyframes: animation.keyframes.len() });
        animation.keyframes.push(Keyframes {
            interpolation: Interpolation::Linear,
            times: vec![0.0, 0.5 * DURATION, DURATION],
            components: values.len() / 3,
            values,
        });
    }
    animation
}
