//! Damaged files: whatever bytes they have, the loader returns a model or an error.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use proptest::prelude::*;
use serde_json::json;

use crate::glb::{Glb, load};
use crate::images::png;

/// A file with something of most kinds in it.
fn rich() -> Vec<u8> {
    let mut glb = Glb::with_primitive(|glb| {
        let positions: [[i16; 4]; 4] =
            [[0, 0, 0, 0], [32767, 0, 0, 0], [0, 32767, 0, 0], [32767, 32767, 9, 0]];
        let positions = glb.accessor(bytemuck::cast_slice(&positions), crate::glb::SHORT, "VEC3", 4);
        glb.json["accessors"][positions]["normalized"] = json!(true);
        glb.json["bufferViews"][positions]["byteStride"] = json!(8);
        let coordinates = glb.floats(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]);
        let joints = glb.accessor(&[0; 16], crate::glb::UNSIGNED_BYTE, "VEC4", 4);
        let weights = glb.floats(&[[1.0, 0.0, 0.0, 0.0]; 4]);
        let target = glb.floats(&[[0.0, 0.0, 1.0]; 4]);
        let indices = glb.indices(&[0, 1, 2, 3]);
        json!({ "attributes": { "POSITION": positions, "TEXCOORD_0": coordinates, "JOINTS_0": joints,
                                "WEIGHTS_0": weights },
                "targets": [{ "POSITION": target }], "indices": indices, "mode": 5, "material": 0 })
    });
    glb.uses("KHR_mesh_quantization").uses("EXT_meshopt_compression").uses("KHR_lights_punctual");
    let view = glb.view(&png(2, 1, &[1, 2, 3, 4, 5, 6, 7, 8]));
    glb.push("images", json!({ "bufferView": view }));
    glb.push("textures", json!({ "source": 0 }));
    glb.push(
        "materials",
        json!({ "normalTexture": { "index": 0 },
        "extensions": { "KHR_materials_sheen": { "sheenColorTexture": { "index": 0 } } } }),
    );
    glb.push("skins", json!({ "joints": [1] }));
    glb.at("/nodes/0")["skin"] = json!(0);
    glb.at("/nodes/0")["children"] = json!([1]);
    let translations = meshopt::encode_vertex_buffer_level(&[[1.0_f32, 2.0, 3.0]; 5], 2, Some(1)).unwrap();
    let start = glb.view(&translations);
    let offset = glb.json["bufferViews"][start]["byteOffset"].clone();
    *glb.at(&format!("/bufferViews/{start}")) = json!({ "buffer": 0, "byteLength": 60, "extensions": {
        "EXT_meshopt_compression": { "buffer": 0, "byteOffset": offset, "byteLength": translations.len(),
            "byteStride": 12, "count": 5, "mode": "ATTRIBUTES" } } });
    let instances = glb
        .push("accessors", json!({ "bufferView": start, "componentType": 5126, "type": "VEC3", "count": 5 }));
    glb.push(
        "nodes",
        json!({ "mesh": 0, "extensions": {
        "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": instances } },
        "KHR_lights_punctual": { "light": 0 } } }),
    );
    glb.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    let times = glb.floats(&[[0.0], [1.0]]);
    let values = glb.floats(&[[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]);
    glb.push(
        "animations",
        json!({ "samplers": [{ "input": times, "output": values }],
                "channels": [{ "sampler": 0, "target": { "node": 1, "path": "translation" } }] }),
    );
    glb.to_glb()
}

/// Loads bytes, and poses what is loaded.
fn try_all(bytes: &[u8]) {
    if let Ok(model) = load(bytes) {
        for animation in [None, Some(0)] {
            for seconds in [-1.0, 0.5, f32::NAN, f32::INFINITY] {
                let pose = model.pose(animation, seconds);
                (0..model.scenes.len()).for_each(|scene| _ = model.bounds(scene, &pose));
            }
        }
    }
}

#[test]
fn the_file_is_right_before_it_is_damaged() {
    let model = load(&rich()).unwrap();
    assert_eq!(model.warnings, []);
    assert!(model.bounds(0, &model.pose(Some(0), 0.5)).is_some());
}

#[test]
fn every_cut_is_an_error() {
    let bytes = rich();
    (0..bytes.len()).for_each(|length| assert!(load(&bytes[..length]).is_err(), "{length}"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_bytes_never_panic(changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = rich();
        for (index, byte) in changes {
            let index = index.index(bytes.len());
            bytes[index] = byte;
        }
        try_all(&bytes);
    }

    #[test]
    fn changed_digits_of_the_json_never_panic(
        changes in proptest::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 1..4),
    ) {
        let mut bytes = rich();
        let json = 20..20 + u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
        let digits: Vec<usize> = json.filter(|index| bytes[*index].is_ascii_digit()).collect();
        for (index, digit) in changes {
            bytes[*index.get(&digits)] = digit;
        }
        try_all(&bytes);
    }
}
