//! Skins and animations.

use std::collections::HashSet;

use glam::Mat4;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::animation::{self as json, Interpolation as JsonInterpolation, Property};
use gltf::json::validation::Checked;

use super::accessors::Accessors;
use super::place::place;
use crate::{
    Animation, Channel, ChannelPath, Interpolation, Keyframes, Mesh, Node, Problem, Skin, Transform, Warning,
};

/// Reads skins.
pub(super) fn read_skins(accessors: Accessors<'_>) -> Result<Vec<Skin>, Problem> {
    let mut skins = Vec::new();
    for (index, json) in accessors.document.root.skins.iter().enumerate() {
        let place = place("skin", index, json.name.as_deref());
        let joints: Vec<usize> = json.joints.iter().map(|joint| joint.value()).collect();
        if joints.is_empty() {
            return Err(Problem::Rule { place, rule: "it has no joints".into() });
        }
        let matrices =
            json.inverse_bind_matrices.map(|accessor| read_matrices(accessors, accessor.value(), &place));
        let mut matrices = matrices.unwrap_or_else(|| Ok(vec![Mat4::IDENTITY; joints.len()]))?;
        if matrices.len() < joints.len() {
            let place = format!("the list of inverse bind matrices of {place}");
            return Err(Problem::Count { place, found: matrices.len() as u64, wanted: joints.len() as u64 });
        }
        matrices.truncate(joints.len());
        let skeleton = json.skeleton.map(|node| node.value());
        skins.push(Skin { name: json.name.clone(), joints, inverse_bind_matrices: matrices, skeleton });
    }
    Ok(skins)
}

fn read_matrices(accessors: Accessors<'_>, index: usize, place: &str) -> Result<Vec<Mat4>, Problem> {
    let accessor = accessors.open(index, place)?;
    if accessor.shape != Type::Mat4 || accessor.component != ComponentType::F32 {
        return Err(accessor.wrong_type("MAT4 of FLOAT"));
    }
    let matrices = accessor.read_floats::<16>(0.0)?;
    Ok(matrices.iter().map(Mat4::from_cols_array).collect())
}

/// Checks that the joints of each skinned mesh are in range of the skins that nodes use with it.
pub(super) fn check_joints(nodes: &[Node], meshes: &[Mesh], skins: &[Skin]) -> Result<(), Problem> {
    let mut largest: Vec<Option<u16>> = vec![None; meshes.len()];
    let mut known = vec![false; meshes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let Some((mesh, skin)) = node.mesh.zip(node.skin) else { continue };
        if !std::mem::replace(&mut known[mesh], true) {
            let sets = meshes[mesh].primitives.iter().flat_map(|primitive| &primitive.joints);
            largest[mesh] = sets.flat_map(|set| set.as_flattened()).copied().max();
        }
        let count = skins[skin].joints.len();
        if let Some(joint) = largest[mesh].filter(|joint| usize::from(*joint) >= count) {
            let place = format!(
                "{}, {}, {}",
                place("node", index, node.name.as_deref()),
                place("mesh", mesh, meshes[mesh].name.as_deref()),
                place("skin", skin, skins[skin].name.as_deref())
            );
            return Err(Problem::OutOfRange {
                place,
                what: "joint",
                index: joint.into(),
                count: count as u64,
            });
        }
    }
    Ok(())
}

/// Reads animations. Channels that nothing can play are left out, with a warning.
pub(super) fn read_animations(
    accessors: Accessors<'_>,
    nodes: &[Node],
    meshes: &[Mesh],
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Animation>, Problem> {
    let mut animations = Vec::new();
    for (index, json) in accessors.document.root.animations.iter().enumerate() {
        let place = place("animation", index, json.name.as_deref());
        let mut animation = Animation { name: json.name.clone(), ..Animation::default() };
        for (number, sampler) in json.samplers.iter().enumerate() {
            let place = format!("{place}, sampler {number}");
            animation.keyframes.push(read_keyframes(accessors, sampler, &place)?);
        }
        check_targets(accessors, json, &place)?;
        let mut moved = HashSet::new();
        for (number, json) in json.channels.iter().enumerate() {
            let place = format!("{place}, channel {number}");
            let Some(channel) = read_channel(json, nodes, meshes, &animation.keyframes, &place, warnings)?
            else {
                continue;
            };
            if moved.insert((channel.node, channel.path)) {
                animation.channels.push(channel);
            } else {
                let feature = "a second channel for the same property of the same node".into();
                warnings.push(Warning::FeatureIgnored { place, feature });
            }
        }
        animations.push(animation);
    }
    Ok(animations)
}

fn read_keyframes(accessors: Accessors<'_>, json: &json::Sampler, place: &str) -> Result<Keyframes, Problem> {
    let interpolation = match json.interpolation {
        Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
        Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::CubicSpline,
        _ => Interpolation::Linear,
    };
    let input = accessors.open(json.input.value(), place)?;
    if input.shape != Type::Scalar || input.component != ComponentType::F32 {
        return Err(input.wrong_type("SCALAR of FLOAT"));
    }
    let times = input.read_flat()?;
    let rises = times.windows(2).all(|pair| pair[0] <= pair[1]);
    if times.is_empty() || times[0] < 0.0 || !rises {
        let rule = "its times do not rise from 0 or more".into();
        return Err(Problem::Rule { place: input.place, rule });
    }
    let output = accessors.open(json.output.value(), place)?;
    if output.component == ComponentType::U32 || output.component != ComponentType::F32 && !output.normalized
    {
        return Err(output.wrong_type("FLOAT or normalized integers"));
    }
    let values = output.read_flat()?;
    let parts = if interpolation == Interpolation::CubicSpline { 3 } else { 1 } * times.len() as u64;
    let vectors = output.shape != Type::Scalar;
    // Weights of morph targets are scalars, several for each keyframe.
    if output.count == 0 || !output.count.is_multiple_of(parts) || vectors && output.count != parts {
        return Err(Problem::Count { place: output.place, found: output.count, wanted: parts });
    }
    let components = values.len() / parts as usize;
    Ok(Keyframes { interpolation, times, components, values })
}

/// Checks the targets of channels, which the `gltf` crate does not, and that weights of morph targets are scalars and
/// nothing else is.
fn check_targets(accessors: Accessors<'_>, json: &json::Animation, place: &str) -> Result<(), Problem> {
    let nodes = accessors.document.root.nodes.len();
    for (number, channel) in json.channels.iter().enumerate() {
        let place = format!("{place}, channel {number}");
        let node = channel.target.node.value();
        if node >= nodes {
            return Err(Problem::OutOfRange { place, what: "node", index: node as u64, count: nodes as u64 });
        }
        let (shape, wanted) = match channel.target.path {
            Checked::Valid(Property::MorphTargetWeights) => (Type::Scalar, "SCALAR"),
            Checked::Valid(Property::Rotation) => (Type::Vec4, "VEC4"),
            Checked::Valid(Property::Translation | Property::Scale) => (Type::Vec3, "VEC3"),
            Checked::Invalid => {
                return Err(Problem::Rule { place, rule: "its target path is unknown".into() });
            }
        };
        let output = json.samplers[channel.sampler.value()].output.value();
        let accessor = accessors.open(output, &place)?;
        if accessor.shape != shape {
            return Err(accessor.wrong_type(wanted));
        }
    }
    Ok(())
}

fn read_channel(
    json: &json::Channel,
    nodes: &[Node],
    meshes: &[Mesh],
    keyframes: &[Keyframes],
    place: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Option<Channel>, Problem> {
    let (index, Checked::Valid(path)) = (json.target.node.value(), json.target.path) else { return Ok(None) };
    let node = &nodes[index];
    let ignore = |what: &str| Warning::FeatureIgnored { place: place.into(), feature: what.into() };
    let targets = node.mesh.map_or(0, |mesh| meshes[mesh].weights.len());
    let (path, wanted) = match path {
        Property::Translation => (ChannelPath::Translation, 3),
        Property::Rotation => (ChannelPath::Rotation, 4),
        Property::Scale => (ChannelPath::Scale, 3),
        Property::MorphTargetWeights => (ChannelPath::Weights, targets),
    };
    if path == ChannelPath::Weights && targets == 0 {
        warnings.push(ignore("the animation of weights of a node without morph targets"));
        return Ok(None);
    }
    if path != ChannelPath::Weights && matches!(node.transform, Transform::Matrix(_)) {
        warnings.push(ignore("the animation of a node whose transform is a matrix"));
        return Ok(None);
    }
    let sampler = json.sampler.value();
    let found = keyframes[sampler].components;
    if found != wanted {
        let place = format!("a value of {place}");
        return Err(Problem::Count { place, found: found as u64, wanted: wanted as u64 });
    }
    Ok(Some(Channel { node: index, path, keyframes: sampler }))
}
