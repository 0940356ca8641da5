//! Animations, skins and morph targets, against computations in f64.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{DMat4, DVec3};
use lvk_gltf::{ChannelPath, Model, Problem};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::glb::{BYTE, FLOAT, Glb, UNSIGNED_BYTE, UNSIGNED_SHORT, assert_close};

/// A file with an animation of one channel that moves node 0.
fn animated(path: &str, interpolation: &str, times: &[f32], values: &[f32]) -> Glb {
    let mut glb = Glb::new();
    glb.push("nodes", json!({}));
    glb.push("scenes", json!({ "nodes": [0] }));
    add_animation(&mut glb, path, interpolation, times, values);
    glb
}

fn add_animation(glb: &mut Glb, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
    let (shape, components) = match path {
        "rotation" => ("VEC4", 4),
        "weights" => ("SCALAR", 1),
        _ => ("VEC3", 3),
    };
    let input = glb.accessor(bytemuck::cast_slice(times), FLOAT, "SCALAR", times.len());
    let output = glb.accessor(bytemuck::cast_slice(values), FLOAT, shape, values.len() / components);
    glb.push(
        "animations",
        json!({ "name": "Walk", "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
                "channels": [{ "sampler": 0, "target": { "node": 0, "path": path } }] }),
    );
}

/// The value at a time, by the equations of the specification's appendix C, in f64.
fn reference(
    path: &str,
    interpolation: &str,
    times: &[f32],
    values: &[f32],
    components: usize,
    time: f32,
) -> Vec<f64> {
    let cubic = interpolation == "CUBICSPLINE";
    let part = |index: usize| -> Vec<f64> {
        values[index * components..][..components].iter().map(|value| f64::from(*value)).collect()
    };
    let value = |key: usize| part(if cubic { 3 * key + 1 } else { key });
    let last = times.len() - 1;
    let mut result = if time <= times[0] {
        value(0)
    } else if time >= times[last] {
        value(last)
    } else {
        let k = (0..last).find(|k| times[*k] <= time && time < times[k + 1]).unwrap();
        let length = f64::from(times[k + 1]) - f64::from(times[k]);
        let t = (f64::from(time) - f64::from(times[k])) / length;
        let (a, b) = (value(k), value(k + 1));
        match interpolation {
            "STEP" => a,
            "LINEAR" if path == "rotation" => {
                let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
                let angle = dot.abs().min(1.0).acos();
                let sign = if dot < 0.0 { -1.0 } else { 1.0 };
                if angle < 1e-6 {
                    a
                } else {
                    let weights =
                        [((1.0 - t) * angle).sin() / angle.sin(), sign * (t * angle).sin() / angle.sin()];
                    a.iter().zip(&b).map(|(a, b)| weights[0] * a + weights[1] * b).collect()
                }
            }
            "LINEAR" => a.iter().zip(&b).map(|(a, b)| (1.0 - t) * a + t * b).collect(),
            _ => {
                let (out, into) = (part(3 * k + 2), part(3 * k + 3));
                (0..components)
                    .map(|i| {
                        (2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0) * a[i]
                            + length * (t.powi(3) - 2.0 * t.powi(2) + t) * out[i]
                            + (-2.0 * t.powi(3) + 3.0 * t.powi(2)) * b[i]
                            + length * (t.powi(3) - t.powi(2)) * into[i]
                    })
                    .collect()
            }
        }
    };
    if path == "rotation" {
        let length = result.iter().map(|number| number * number).sum::<f64>().sqrt();
        result.iter_mut().for_each(|number| *number /= length);
    }
    result
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn keyframes_are_interpolated_as_the_specification_says(
        numbers in proptest::collection::vec(-1.0_f32..1.0, 3 * 4 * 6),
        steps in proptest::collection::vec(0.1_f32..2.0, 5),
        at in -1.0_f32..12.0,
    ) {
        let times: Vec<f32> = std::iter::once(0.25)
            .chain(steps.iter().scan(0.25, |sum, step| { *sum += step; Some(*sum) }))
            .collect();
        for interpolation in ["STEP", "LINEAR", "CUBICSPLINE"] {
            for (path, kind, components) in [
                ("translation", ChannelPath::Translation, 3),
                ("scale", ChannelPath::Scale, 3),
                ("rotation", ChannelPath::Rotation, 4),
            ] {
                let parts = if interpolation == "CUBICSPLINE" { 3 } else { 1 };
                let mut values = numbers[..parts * components * times.len()].to_vec();
                if path == "rotation" {
                    // Unit quaternions, but for tangents.
                    for (index, value) in values.chunks_mut(4).enumerate() {
                        if parts == 1 || index % 3 == 1 {
                            let unit = glam::Vec4::from_slice(value).normalize_or(glam::Vec4::W);
                            value.copy_from_slice(&unit.to_array());
                        }
                    }
                }
                let model = animated(path, interpolation, &times, &values).load_cleanly();
                let found = model.animations[0].keyframes[0].sample(at, kind);
                let wanted = reference(path, interpolation, &times, &values, components, at);
                let length = wanted.iter().map(|number| number * number).sum::<f64>().sqrt();
                if length.is_finite() {
                    assert_close(&found, &wanted, 2e-4);
                }
            }
        }
    }
}

#[test]
fn a_pose_moves_nodes_and_their_children() {
    let mut glb = animated("translation", "LINEAR", &[1.0, 3.0], &[0.0, 0.0, 0.0, 10.0, 20.0, 30.0]);
    glb.push("nodes", json!({ "translation": [0.0, 0.0, 5.0] }));
    glb.at("/nodes/0")["children"] = json!([1]);
    glb.at("/nodes/0")["scale"] = json!([2.0, 2.0, 2.0]);
    let model = glb.load_cleanly();
    assert_eq!(model.animations[0].duration(), 3.0);
    let at = |seconds| model.pose(Some(0), seconds).world[1].transform_point3(glam::Vec3::ZERO).to_array();
    assert_eq!(
        [at(0.0), at(1.0), at(2.0), at(9.0)],
        [[0.0, 0.0, 10.0], [0.0, 0.0, 10.0], [5.0, 10.0, 25.0], [10.0, 20.0, 40.0],]
    );
    assert_eq!(model.pose(None, 2.0), model.pose(Some(7), 2.0));
}

#[test]
fn normalized_integers_are_rotations() {
    let mut glb = Glb::new();
    glb.push("nodes", json!({}));
    let input = glb.floats(&[[0.0], [1.0]]);
    let output = glb.accessor(&[0, 0, 0, 127, 0, 127, 0, 0], BYTE, "VEC4", 2);
    glb.json["accessors"][output]["normalized"] = json!(true);
    glb.push(
        "animations",
        json!({ "samplers": [{ "input": input, "output": output }],
                "channels": [{ "sampler": 0, "target": { "node": 0, "path": "rotation" } }] }),
    );
    let model = glb.load_cleanly();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert_close(
        &model.animations[0].keyframes[0].sample(0.5, ChannelPath::Rotation),
        &[0.0, half, 0.0, half],
        1e-6,
    );
}

/// A quad of four vertices that two joints move, the second one a child of the first.
fn skinned() -> Glb {
    let mut glb = Glb::with_primitive(|glb| {
        let positions = glb.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 2.0, 0.5]]);
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 4]);
        let joints = [0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0];
        let joints = glb.accessor(&joints, UNSIGNED_BYTE, "VEC4", 4);
        let weights: [[u16; 4]; 4] =
            [[65535, 0, 0, 0], [65535, 0, 0, 0], [32768, 32767, 0, 0], [13107, 52428, 0, 0]];
        let weights = glb.accessor(bytemuck::cast_slice(&weights), UNSIGNED_SHORT, "VEC4", 4);
        glb.json["accessors"][weights]["normalized"] = json!(true);
        let indices = glb.indices(&[0, 1, 2, 2, 1, 3]);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights },
                "indices": indices })
    });
    let inverse = |x: f32, y: f32| glam::Mat4::from_translation(glam::Vec3::new(x, y, 0.0)).to_cols_array();
    let matrices = glb.floats(&[inverse(0.0, 0.0), inverse(0.0, -1.0)]);
    glb.push("nodes", json!({ "children": [2], "translation": [3.0, 0.0, 0.0] }));
    glb.push("nodes", json!({ "translation": [0.0, 1.0, 0.0], "rotation": [0.0, 0.0, 0.6, 0.8] }));
    glb.push("skins", json!({ "joints": [1, 2], "inverseBindMatrices": matrices, "skeleton": 1 }));
    // The transform of the node has no effect on a skinned mesh.
    *glb.at("/nodes/0") = json!({ "mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0] });
    *glb.at("/scenes/0/nodes") = json!([0, 1]);
    glb
}

#[test]
fn joints_move_vertices_by_their_weights() {
    let model = skinned().load_cleanly();
    let pose = model.pose(None, 0.0);
    let first = DMat4::from_translation(DVec3::new(3.0, 0.0, 0.0));
    let angle = 2.0 * 0.6_f64.atan2(0.8);
    let second = first * DMat4::from_translation(DVec3::new(0.0, 1.0, 0.0)) * DMat4::from_rotation_z(angle);
    let second = second * DMat4::from_translation(DVec3::new(0.0, -1.0, 0.0));
    let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 2.0, 0.5]].map(DVec3::from);
    let half = 32768.0 / 65535.0;
    let (a, b) = (|p| first.transform_point3(p), |p| second.transform_point3(p));
    let wanted = [
        a(positions[0]),
        b(positions[1]),
        half * a(positions[2]) + (1.0 - half) * b(positions[2]),
        0.2 * b(positions[3]) + 0.8 * a(positions[3]),
    ];
    let primitive = &model.meshes[0].primitives[0];
    for (vertex, wanted) in wanted.iter().enumerate() {
        let found = primitive.position_at(vertex, &pose.weights[0], &pose.joints[0]);
        assert_close(&found.to_array(), &wanted.to_array(), 1e-5);
    }
    let placements = model.placements(0, &pose);
    assert_eq!(
        (placements.len(), placements[0].skin, placements[0].transform),
        (1, Some(0), glam::Mat4::IDENTITY)
    );
    let bounds = model.bounds(0, &pose).unwrap();
    let least = wanted.iter().copied().reduce(DVec3::min).unwrap();
    assert_close(&bounds.min.to_array(), &least.to_array(), 1e-5);
}

#[test]
fn weights_are_made_to_sum_up_to_one() {
    let with_weights = |weights: [f32; 4]| {
        Glb::with_primitive(|glb| {
            let positions = glb.triangle_positions();
            let normals = glb.floats(&[[0.0, 0.0, 1.0]; 3]);
            let joints = glb.accessor(&[5, 6, 7, 8].repeat(3), UNSIGNED_BYTE, "VEC4", 3);
            let weights = glb.floats(&[weights; 3]);
            json!({ "attributes": {
                "POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights } })
        })
    };
    for (weights, wanted, joints, warns) in [
        ([0.25, 0.75, 0.0, 0.0], [0.25, 0.75, 0.0, 0.0], [5, 6, 0, 0], false),
        ([1.0, 3.0, 0.0, 0.0], [0.25, 0.75, 0.0, 0.0], [5, 6, 0, 0], true),
        ([1.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [5, 0, 0, 0], true),
        ([0.0; 4], [1.0, 0.0, 0.0, 0.0], [5, 0, 0, 0], true),
    ] {
        let model: Model = with_weights(weights).load();
        let primitive = &model.meshes[0].primitives[0];
        assert_eq!((primitive.weights[0][0], primitive.joints[0][0]), (wanted, joints));
        assert_eq!(model.warnings.len(), usize::from(warns), "{weights:?}");
    }
}

#[test]
fn wrong_skins_are_refused() {
    let changed = |pointer: &str, value: Value| {
        let mut glb = skinned();
        *glb.at(pointer) = value;
        glb.problem()
    };
    let message = changed("/skins/0/joints", json!([1])).to_string();
    assert!(
        message.contains("node 0, mesh 0 'Body', skin 0: joint 1 is out of range, as there are 1"),
        "{message}"
    );
    assert!(matches!(changed("/skins/0/joints", json!([])), Problem::Rule { .. }));
    assert!(matches!(
        changed("/skins/0/joints", json!([1, 2, 1])),
        Problem::Count { found: 2, wanted: 3, .. }
    ));
    assert!(matches!(changed("/skins/0/inverseBindMatrices", json!(0)), Problem::AccessorType { .. }));
    let attributes = "/meshes/0/primitives/0/attributes";
    let mut glb = skinned();
    glb.at(attributes).as_object_mut().unwrap().remove("WEIGHTS_0");
    glb.expect_problem(&["mesh 0 'Body', primitive 0: it has 1 set of joints and 0 sets of weights"]);
}

/// A triangle with two morph targets, and weights of mesh and node.
fn morphed() -> Glb {
    let mut glb = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 3]);
        let first = glb.floats(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]]);
        let second = glb.floats(&[[0.0, 0.5, 0.0]; 3]);
        let normal = glb.floats(&[[0.0, 1.0, 0.0]; 3]);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals },
                "targets": [{ "POSITION": first, "NORMAL": normal, "TANGENT": normal }, { "POSITION": second }] })
    });
    glb.at("/meshes/0")["weights"] = json!([0.5, 0.25]);
    glb
}

#[test]
fn morph_targets_are_added_by_their_weights() {
    let mut glb = morphed();
    let model = glb.load_cleanly();
    let primitive = &model.meshes[0].primitives[0];
    let targets = &primitive.morph_targets;
    assert_eq!(
        (targets.len(), targets[0].normals[2], targets[0].tangents[1]),
        (2, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0])
    );
    assert!(targets[1].normals.is_empty());
    let at = |model: &Model, animation, seconds, vertex| {
        let pose = model.pose(animation, seconds);
        model.meshes[0].primitives[0].position_at(vertex, &pose.weights[0], &[]).to_array()
    };
    assert_eq!(at(&model, None, 0.0, 1), [1.0, 1.125, 0.0]);
    glb.at("/nodes/0")["weights"] = json!([0.0, 1.0]);
    assert_eq!(at(&glb.load_cleanly(), None, 0.0, 1), [1.0, 0.5, 0.0]);
    add_animation(&mut glb, "weights", "LINEAR", &[0.0, 2.0], &[0.0, 0.0, 1.0, 4.0]);
    let model = glb.load_cleanly();
    assert_eq!(at(&model, Some(0), 1.0, 2), [0.0, 2.0, 1.5]);
    let mut glb = morphed();
    let cubic: Vec<f32> = [[0.0; 6], [0.0, 0.0, 1.0, 4.0, 0.0, 0.0]].concat();
    add_animation(&mut glb, "weights", "CUBICSPLINE", &[0.0, 2.0], &cubic);
    assert_eq!(glb.load_cleanly().animations[0].keyframes[0].components, 2);
    assert_eq!(at(&glb.load_cleanly(), Some(0), 1.0, 2), [0.0, 2.0, 1.5]);
}

#[test]
fn wrong_morph_targets_are_refused() {
    let mut glb = morphed();
    glb.at("/meshes/0")["weights"] = json!([1.0]);
    glb.expect_problem(&["the list of weights of mesh 0 'Body' has 1 entries, but 2 are needed"]);
    let mut glb = morphed();
    glb.at("/nodes/0")["weights"] = json!([1.0, 2.0, 3.0]);
    glb.expect_problem(&["the list of weights of node 0 has 3 entries, but 2 are needed"]);
    let mut glb = morphed();
    glb.at("/accessors/2")["count"] = json!(2);
    glb.expect_problem(&[
        "mesh 0 'Body', primitive 0, morph target 0, accessor 2 has 2 entries, but 3 are needed",
    ]);
    let mut glb = morphed();
    glb.at("/meshes/0/primitives/0/targets/1")["COLOR_0"] = json!(2);
    assert_eq!(
        glb.warnings(),
        ["mesh 0 'Body', primitive 0: attribute COLOR_0 of a morph target is ignored"]
    );
    let mut glb = morphed();
    let mut second = glb.json["meshes"][0]["primitives"][0].clone();
    second["targets"] = json!([]);
    glb.at("/meshes/0/primitives").as_array_mut().unwrap().push(second);
    assert!(matches!(glb.problem(), Problem::Count { found: 0, wanted: 2, .. }));
}

#[test]
fn wrong_animations_are_refused_and_useless_channels_warned_of() {
    let still = [0.0; 6];
    animated("translation", "LINEAR", &[1.0, 0.5], &still)
        .expect_problem(&["animation 0 'Walk', sampler 0", "do not rise"]);
    animated("translation", "LINEAR", &[-1.0, 0.5], &still).expect_problem(&["do not rise from 0 or more"]);
    let problem = animated("translation", "LINEAR", &[0.0, 1.0, 2.0], &still).problem();
    assert!(matches!(problem, Problem::Count { found: 2, wanted: 3, .. }), "{problem}");
    let problem = animated("translation", "CUBICSPLINE", &[0.0, 1.0], &still).problem();
    assert!(matches!(problem, Problem::Count { found: 2, wanted: 6, .. }), "{problem}");
    assert!(matches!(
        animated("scale", "STEP", &[0.0, 1.0], &[f32::NAN; 6]).problem(),
        Problem::NotFinite { .. }
    ));
    let channel = "/animations/0/channels/0/target";
    let mut glb = animated("translation", "LINEAR", &[0.0, 1.0], &still);
    glb.at(channel)["path"] = json!("rotation");
    glb.expect_problem(&["VEC3 of FLOAT", "VEC4 is needed"]);
    glb.at(channel)["path"] = json!("pointer");
    glb.expect_problem(&["animation 0 'Walk', channel 0: its target path is unknown"]);

    let mut glb = animated("translation", "LINEAR", &[0.0, 1.0], &still);
    *glb.at("/nodes/0") = json!({ "matrix": glam::Mat4::IDENTITY.to_cols_array() });
    assert_eq!(
        glb.warnings(),
        ["animation 0 'Walk', channel 0: the animation of a node whose transform is a matrix is ignored"]
    );
    let glb = animated("weights", "LINEAR", &[0.0, 1.0], &[0.0, 1.0]);
    assert_eq!(glb.load().animations[0].channels, []);
    let mut glb = animated("translation", "LINEAR", &[0.0, 1.0], &still);
    let channels = glb.at("/animations/0/channels").as_array_mut().unwrap();
    channels.push(channels[0].clone());
    assert_eq!(glb.load().animations[0].channels.len(), 1);
    assert_eq!(glb.warnings().len(), 1);
}

#[test]
fn channels_without_a_node_are_left_out_with_a_warning() {
    let mut glb = animated("translation", "LINEAR", &[0.0, 1.0], &[0.0; 6]);
    let pointer = json!({ "KHR_animation_pointer": { "pointer": "/materials/0/emissiveFactor" } });
    let channel = json!({ "sampler": 0, "target": { "path": "pointer", "extensions": pointer } });
    glb.at("/animations/0/channels").as_array_mut().unwrap().push(channel);
    glb.uses("KHR_animation_pointer");
    assert_eq!(glb.load().animations[0].channels.len(), 1);
    assert_eq!(
        glb.warnings(),
        [
            "the extension KHR_animation_pointer is ignored",
            "animation 0: KHR_animation_pointer of 1 of its channels, which have no node, is ignored",
        ]
    );
}
