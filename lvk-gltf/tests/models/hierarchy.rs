//! Scenes, nodes, cameras, lights and instances.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use glam::{DMat4, DQuat, DVec3, Vec3};
use lvk_gltf::{Camera, Light, LightKind, Model, Problem, Projection, Transform};
use serde_json::{Value, json};

use crate::glb::{FLOAT, Glb, SHORT, assert_close};

fn with_nodes(nodes: &[Value], roots: &[usize]) -> Glb {
    let mut glb = Glb::new();
    for node in nodes {
        glb.push("nodes", node.clone());
    }
    glb.push("scenes", json!({ "nodes": roots }));
    glb
}

fn columns(matrix: &glam::Mat4) -> [f32; 16] {
    matrix.to_cols_array()
}

#[test]
fn scenes_list_parents_before_children() {
    let nodes =
        [json!({ "children": [2, 3] }), json!({}), json!({ "children": [1] }), json!({ "name": "Leaf" })];
    let mut glb = with_nodes(&nodes, &[0]);
    glb.push("scenes", json!({ "nodes": [0], "name": "Second" }));
    glb.json["scene"] = json!(1);
    let model = glb.load_cleanly();
    assert_eq!(model.default_scene, Some(1));
    assert_eq!(model.scenes[1].name.as_deref(), Some("Second"));
    assert_eq!(model.scene_nodes(0), [0, 2, 3, 1]);
    assert_eq!(model.scene_nodes(7), [0_usize; 0]);
    assert_eq!(model.nodes[1].parent, Some(2));
    let parents: Vec<_> = model.nodes.iter().map(|node| node.parent).collect();
    assert_eq!(parents, [None, Some(2), Some(0), Some(0)]);
}

#[test]
fn scenes_may_have_no_nodes() {
    let mut glb = Glb::new();
    glb.push("scenes", json!({ "name": "Empty" }));
    let model = glb.load_cleanly();
    assert_eq!((model.default_scene, model.scenes[0].roots.len()), (Some(0), 0));
}

#[test]
fn world_transforms_are_products_of_those_of_all_ancestors() {
    let (half, angle) = (0.3_f64.sin(), 0.3_f64.cos());
    let matrix = [1.0, 2.0, 0.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.0, 0.5, 3.0, 0.0, 7.0, 8.0, 9.0, 1.0];
    let glb = with_nodes(
        &[
            json!({ "translation": [1.0, 2.0, 3.0], "rotation": [0.0, half, 0.0, angle], "scale": [2.0, -1.0, 0.5],
                    "children": [1] }),
            json!({ "matrix": matrix, "children": [2] }),
            json!({ "translation": [-4.0, 0.0, 1.0] }),
        ],
        &[0],
    );
    let first = DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0))
        * DMat4::from_quat(DQuat::from_rotation_y(0.6))
        * DMat4::from_scale(DVec3::new(2.0, -1.0, 0.5));
    let second = first * DMat4::from_cols_array(&matrix);
    let third = second * DMat4::from_translation(DVec3::new(-4.0, 0.0, 1.0));
    let model = glb.load_cleanly();
    assert!(matches!(model.nodes[1].transform, Transform::Matrix(_)));
    for (found, wanted) in model.pose(None, 0.0).world.iter().zip([first, second, third]) {
        assert_close(&columns(found), &wanted.to_cols_array(), 1e-5);
    }
}

#[test]
fn nodes_that_are_no_trees_are_refused() {
    let circle =
        [json!({ "children": [1] }), json!({ "children": [2] }), json!({ "name": "C", "children": [1] })];
    let twice = [json!({ "children": [2] }), json!({ "children": [2] }), json!({ "name": "Hand" })];
    with_nodes(&twice, &[]).expect_problem(&["node 2 'Hand' has the parents 0 and 1; nodes must form trees"]);
    with_nodes(&circle, &[]).expect_problem(&["node 1 has the parents 0 and 2"]);
    let own = [json!({ "children": [0] })];
    let problem = with_nodes(&own, &[]).expect_problem(&["node 0 is its own ancestor"]);
    assert!(matches!(problem, Problem::Hierarchy { .. }));
    let ring = [json!({ "children": [1] }), json!({ "children": [0] }), json!({})];
    with_nodes(&ring, &[2]).expect_problem(&["node 0 is its own ancestor"]);
    with_nodes(&[json!({ "children": [1, 1] }), json!({})], &[])
        .expect_problem(&["node 1 has the parents 0 and 0"]);
    let tree = [json!({ "children": [1] }), json!({})];
    with_nodes(&tree, &[1]).expect_problem(&["scene 0, node 1 is a root and has the parent 0"]);
    with_nodes(&tree, &[0, 0]).expect_problem(&["scene 0, node 0 is a root twice"]);
    let long: Vec<Value> =
        (1..20_000).map(|child| json!({ "children": [child] })).chain([json!({})]).collect();
    assert_eq!(with_nodes(&long, &[0]).load_cleanly().scene_nodes(0).len(), 20_000);
}

#[test]
fn transforms_that_are_none_are_refused_or_corrected() {
    let refuse = |node: Value| with_nodes(&[node], &[0]).problem();
    let mut matrix = glam::Mat4::IDENTITY.to_cols_array();
    matrix[3] = 1.0;
    assert!(matches!(refuse(json!({ "matrix": matrix })), Problem::Rule { .. }));
    assert!(matches!(refuse(json!({ "translation": [0.0, 1e300, 0.0] })), Problem::NotFinite { .. }));
    assert!(matches!(refuse(json!({ "translation": [0.0, 0.0] })), Problem::Json { .. }));
    let large = json!({ "scale": [1e30, 1e30, 1e30] });
    let nested = with_nodes(&[json!({ "scale": [1e30, 1e30, 1e30], "children": [1] }), large], &[0]);
    nested.expect_problem(&["node 1: the product of the transforms of its ancestors is not finite"]);
    let glb = with_nodes(&[json!({ "rotation": [0.0, 0.0, 3.0, 4.0] })], &[0]);
    let Transform::Trs(trs) = glb.load().nodes[0].transform else { unreachable!() };
    assert_eq!(trs.rotation.to_array(), [0.0, 0.0, 0.6, 0.8]);
    assert_eq!(glb.warnings(), ["node 0: corrected a rotation that is not of unit length"]);
}

#[test]
fn cameras_are_perspective_or_orthographic() {
    let mut glb = with_nodes(&[json!({ "camera": 1 })], &[0]);
    let perspective = json!({ "yfov": 0.8, "aspectRatio": 1.5, "znear": 0.1, "zfar": 100.0 });
    glb.push("cameras", json!({ "type": "perspective", "name": "Front", "perspective": perspective }));
    glb.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.2 } }));
    let orthographic = json!({ "xmag": 2.0, "ymag": 3.0, "znear": 0.0, "zfar": 10.0 });
    glb.push("cameras", json!({ "type": "orthographic", "orthographic": orthographic }));
    let model = glb.load_cleanly();
    assert_eq!(model.nodes[0].camera, Some(1));
    let perspective =
        |yfov, aspect_ratio, znear, zfar| Projection::Perspective { yfov, aspect_ratio, znear, zfar };
    assert_eq!(
        model.cameras,
        [
            Camera { name: Some("Front".into()), projection: perspective(0.8, Some(1.5), 0.1, Some(100.0)) },
            Camera { name: None, projection: perspective(0.7, None, 0.2, None) },
            Camera {
                name: None,
                projection: Projection::Orthographic { xmag: 2.0, ymag: 3.0, znear: 0.0, zfar: 10.0 }
            },
        ]
    );
    for wrong in [
        json!({ "yfov": 4.0, "znear": 0.1 }),
        json!({ "yfov": 0.5, "znear": 0.0 }),
        json!({ "yfov": 0.5, "znear": 1.0, "zfar": 0.5 }),
        json!({ "yfov": 0.5, "znear": 1e300 }),
    ] {
        let mut glb = glb.clone();
        glb.at("/cameras/0")["perspective"] = wrong;
        glb.expect_problem(&["camera 0 'Front'", "out of range"]);
    }
}

#[test]
fn lights_have_three_kinds() {
    let mut glb = with_nodes(&[json!({ "extensions": { "KHR_lights_punctual": { "light": 2 } } })], &[0]);
    glb.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "name": "Sun", "color": [1.0, 0.9, 0.8], "intensity": 3.0 },
        { "type": "point", "range": 5.0 },
        { "type": "spot", "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.4 } },
        { "type": "spot", "spot": {} },
    ] } });
    glb.uses("KHR_lights_punctual");
    let model = glb.load_cleanly();
    assert_eq!(model.nodes[0].light, Some(2));
    let light = |kind| Light { name: None, color: [1.0; 3], intensity: 1.0, range: None, kind };
    let spot = |inner_cone_angle, outer_cone_angle| LightKind::Spot { inner_cone_angle, outer_cone_angle };
    let sun = Light {
        name: Some("Sun".into()),
        color: [1.0, 0.9, 0.8],
        intensity: 3.0,
        ..light(LightKind::Directional)
    };
    let wanted = [
        sun,
        Light { range: Some(5.0), ..light(LightKind::Point) },
        light(spot(0.2, 0.4)),
        light(spot(0.0, std::f32::consts::FRAC_PI_4)),
    ];
    assert_eq!(model.lights, wanted);
    glb.at("/extensions/KHR_lights_punctual/lights/2/spot")["outerConeAngle"] = json!(9.0);
    assert_eq!(glb.warnings().len(), 1);
    glb.at("/nodes/0/extensions/KHR_lights_punctual")["light"] = json!(4);
    glb.expect_problem(&["nodes[0].extensions", "out of range"]);
}

/// A triangle in three instances.
fn instanced() -> Glb {
    let mut glb = Glb::triangle();
    let translations = glb.floats(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [0.0, 0.0, 0.0]]);
    let rotations: [[i16; 4]; 3] = [[0, 0, 0, 32767], [0, 0, 32767, 0], [0, 23170, 0, 23170]];
    let rotations = glb.accessor(bytemuck::cast_slice(&rotations), SHORT, "VEC4", 3);
    glb.json["accessors"][rotations]["normalized"] = json!(true);
    let scales = glb.floats(&[[1.0, 1.0, 1.0], [2.0, 3.0, 4.0], [1.0, -1.0, 1.0]]);
    let identifiers = glb.accessor(bytemuck::cast_slice(&[1.0_f32, 2.0, 3.0]), FLOAT, "SCALAR", 3);
    glb.at("/nodes/0")["translation"] = json!([10.0, 0.0, 0.0]);
    glb.at("/nodes/0")["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": {
        "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales, "_ID": identifiers
    } } });
    glb.uses("EXT_mesh_gpu_instancing");
    glb
}

#[test]
fn instances_are_placed_one_by_one() {
    let glb = instanced();
    let model = glb.load();
    assert_eq!(glb.warnings(), ["node 0, EXT_mesh_gpu_instancing: attribute _ID is ignored"]);
    let placements = model.placements(0, &model.pose(None, 0.0));
    assert_eq!(placements.len(), 3);
    let node = DMat4::from_translation(DVec3::new(10.0, 0.0, 0.0));
    let (turn, quarter) = (std::f64::consts::PI, std::f64::consts::FRAC_PI_2);
    let wanted = [
        DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)),
        DMat4::from_scale_rotation_translation(
            DVec3::new(2.0, 3.0, 4.0),
            DQuat::from_rotation_z(turn),
            DVec3::new(4.0, 5.0, 6.0),
        ),
        DMat4::from_scale_rotation_translation(
            DVec3::new(1.0, -1.0, 1.0),
            DQuat::from_rotation_y(quarter),
            DVec3::ZERO,
        ),
    ];
    for (placement, instance) in placements.iter().zip(wanted) {
        assert_eq!((placement.node, placement.mesh, placement.skin), (0, 0, None));
        assert_close(&columns(&placement.transform), &(node * instance).to_cols_array(), 1e-5);
    }
}

#[test]
fn instances_with_wrong_attributes_are_refused() {
    let mut glb = instanced();
    glb.at("/accessors/1")["count"] = json!(2);
    glb.expect_problem(&["node 0, EXT_mesh_gpu_instancing, accessor", "entries, but"]);
    let mut glb = instanced();
    glb.at("/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes")["SCALE"] = json!(2);
    assert!(matches!(glb.problem(), Problem::AccessorType { .. }));
    let mut glb = instanced();
    glb.at("/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes")["SCALE"] = json!(99);
    glb.expect_problem(&["node 0, EXT_mesh_gpu_instancing: accessor 99 is out of range"]);
}

#[test]
fn bounds_are_around_all_placements() {
    let model: Model = instanced().load();
    let bounds = model.bounds(0, &model.pose(None, 0.0)).unwrap();
    // The triangle's corners in the three instances, by hand.
    let wanted = [[10.0, -1.0, -1.0], [14.0, 5.0, 6.0]];
    let min = Vec3::new(10.0, -1.0, -1.0);
    assert!(bounds.min.abs_diff_eq(min, 1e-3), "{bounds:?} {wanted:?}");
    assert!(bounds.max.abs_diff_eq(Vec3::new(14.0, 5.0, 6.0), 1e-3), "{bounds:?}");
    let empty = with_nodes(&[json!({})], &[0]).load_cleanly();
    assert_eq!(empty.bounds(0, &empty.pose(None, 0.0)), None);
}
