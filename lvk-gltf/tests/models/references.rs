//! References, offsets and counts that lead out of what is there.

use lvk_gltf::Problem;
use serde_json::{Value, json};

use crate::glb::Glb;

/// A file in which most objects refer to most others.
fn whole() -> Glb {
    let mut glb = Glb::triangle();
    let matrices = glb.floats(&[glam::Mat4::IDENTITY.to_cols_array()]);
    let times = glb.floats(&[[0.0], [1.0]]);
    let values = glb.floats(&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]);
    glb.push("skins", json!({ "joints": [1], "inverseBindMatrices": matrices, "skeleton": 1 }));
    glb.push("nodes", json!({}));
    glb.push("materials", json!({}));
    glb.push(
        "animations",
        json!({ "name": "Walk",
            "samplers": [{ "input": times, "output": values }],
            "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }] }),
    );
    glb.at("/meshes/0/primitives/0")["material"] = json!(0);
    glb.json["scene"] = json!(0);
    glb
}

fn changed(pointer: &str, value: Value) -> Problem {
    let mut glb = whole();
    *glb.at(pointer) = value;
    glb.problem()
}

#[test]
fn the_file_is_right_before_it_is_changed() {
    whole().load_cleanly();
}

#[test]
fn references_out_of_range_are_refused_wherever_they_are() {
    for pointer in [
        "/scene",
        "/scenes/0/nodes/0",
        "/nodes/0/mesh",
        "/meshes/0/primitives/0/material",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/accessors/0/bufferView",
        "/bufferViews/0/buffer",
        "/skins/0/joints/0",
        "/skins/0/inverseBindMatrices",
        "/skins/0/skeleton",
        "/animations/0/samplers/0/input",
        "/animations/0/samplers/0/output",
        "/animations/0/channels/0/sampler",
        "/animations/0/channels/0/target/node",
    ] {
        let problem = changed(pointer, json!(77));
        assert!(matches!(problem, Problem::Rule { .. } | Problem::OutOfRange { .. }), "{pointer}: {problem}");
        assert!(problem.to_string().contains("out of range"), "{pointer}: {problem}");
        for number in [json!(4_294_967_296_u64), json!(-1), json!("0"), json!(0.5)] {
            let problem = changed(pointer, number);
            assert!(matches!(problem, Problem::Json { .. }), "{pointer}: {problem}");
        }
    }
}

#[test]
fn names_of_objects_are_in_the_message() {
    let message = changed("/animations/0/samplers/0/input", json!(77)).to_string();
    assert!(
        message.contains("animations[0].samplers[0].input of 'Walk': the reference is out of range"),
        "{message}"
    );
    let message = changed("/meshes/0/primitives/0/attributes/POSITION", json!(77)).to_string();
    assert!(
        message.contains("mesh 0 'Body', primitive 0: accessor 77 is out of range, as there are 4"),
        "{message}"
    );
}

#[test]
fn offsets_and_counts_out_of_range_are_refused() {
    const MOST: u64 = u64::MAX;
    for (pointer, value) in [
        ("/bufferViews/0/byteOffset", json!(MOST)),
        ("/bufferViews/0/byteLength", json!(MOST)),
        ("/bufferViews/0/byteLength", json!(35)),
        ("/bufferViews/0/byteOffset", json!(100_000)),
        ("/accessors/0/count", json!(4)),
        ("/accessors/0/count", json!(u32::MAX)),
    ] {
        let problem = changed(pointer, value);
        assert!(matches!(problem, Problem::Truncated { .. }), "{pointer}: {problem}");
    }
    let problem = changed("/accessors/0/count", json!(MOST));
    assert!(matches!(problem, Problem::Rule { .. }), "{problem}");
    let mut glb = whole();
    glb.at("/accessors/0")["byteOffset"] = json!(1);
    glb.expect_problem(&["accessor 0 ends at byte 37 of buffer view 0, which has 36"]);
    glb.at("/accessors/0")["byteOffset"] = json!(MOST);
    assert!(matches!(glb.problem(), Problem::Truncated { .. }));
    let mut glb = whole();
    glb.at("/bufferViews/0")["byteStride"] = json!(8);
    glb.expect_problem(&["accessor 0: its elements of 12 bytes overlap, as they are 8 bytes apart"]);
    glb.at("/bufferViews/0")["byteStride"] = json!(1000);
    glb.expect_problem(&["bufferViews[0].byteStride", "not allowed"]);
}

#[test]
fn missing_properties_and_unknown_values_are_refused() {
    let mut glb = whole();
    glb.at("/accessors/0")["type"] = json!("VEC5");
    glb.expect_problem(&["accessors[0].type", "not allowed"]);
    let mut glb = whole();
    glb.at("/accessors/0")["componentType"] = json!(5124);
    glb.expect_problem(&["accessors[0].componentType", "not allowed"]);
    let mut glb = whole();
    if let Some(accessor) = glb.at("/accessors/0").as_object_mut() {
        accessor.remove("bufferView");
    }
    glb.expect_problem(&["accessors[0].bufferView", "missing"]);
    let problem = changed("/nodes", json!({}));
    assert!(matches!(problem, Problem::Json { .. }), "{problem}");
}

#[test]
fn many_users_of_one_accessor_are_bounded() {
    // Each primitive takes 40 bytes of the file and 36 KB of memory.
    let mut glb = Glb::new();
    let positions = glb.floats(&vec![[0.0; 3]; 3000]);
    let primitive = json!({ "attributes": { "POSITION": positions } });
    glb.push("meshes", json!({ "primitives": vec![primitive; 10_000] }));
    let problem = glb.expect_problem(&["mesh 0, primitive ", "raise LoadOptions::memory"]);
    assert!(matches!(problem, Problem::Memory { .. }));
}
