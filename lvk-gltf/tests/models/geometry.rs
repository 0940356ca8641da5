//! Primitives: arrangements of triangles, attributes and their types.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::{Positions, Problem, Warning};
use serde_json::json;

use crate::glb::{BYTE, FLOAT, Glb, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT};

const SQUARE: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0]];

/// A primitive of this mode, with normals so that its vertices stay as they are.
fn with_mode(mode: u32, indices: Option<&[u16]>) -> Glb {
    Glb::with_primitive(|glb| {
        let positions = glb.floats(&SQUARE);
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 5]);
        let mut primitive =
            json!({ "mode": mode, "attributes": { "POSITION": positions, "NORMAL": normals } });
        if let Some(indices) = indices {
            primitive["indices"] = json!(glb.indices(indices));
        }
        primitive
    })
}

#[test]
fn strips_and_fans_become_lists_with_one_front() {
    let list = |mode, indices| with_mode(mode, indices).primitive().indices;
    assert_eq!(list(4, Some(&[0, 1, 2, 2, 1, 3])), [0, 1, 2, 2, 1, 3]);
    assert_eq!(list(5, None), [0, 1, 2, 1, 3, 2, 2, 3, 4]);
    assert_eq!(list(5, Some(&[4, 3, 2, 1])), [4, 3, 2, 3, 1, 2]);
    assert_eq!(list(6, Some(&[0, 1, 3, 2])), [1, 3, 0, 3, 2, 0]);
    assert_eq!(list(6, None), [1, 2, 0, 2, 3, 0, 3, 4, 0]);
    // The square's front is that of its normal, whichever way it is put together.
    for (mode, indices) in [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])] {
        let primitive = with_mode(mode, Some(&indices)).primitive();
        for corners in primitive.indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|k| glam::Vec3::from(SQUARE[corners[k] as usize]));
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }
}

#[test]
fn points_and_lines_are_left_out_with_a_warning() {
    for (mode, name) in [(0, "POINTS"), (1, "LINES"), (2, "LINE_LOOP"), (3, "LINE_STRIP")] {
        let model = with_mode(mode, None).load();
        assert!(model.meshes[0].primitives.is_empty());
        let place = "mesh 0 'Body', primitive 0".to_owned();
        assert_eq!(model.warnings, [Warning::NoTriangles { place, mode: name }]);
    }
    with_mode(7, None).expect_problem(&["meshes[0].primitives[0].mode", "not allowed"]);
}

#[test]
fn incomplete_triangles_are_left_out_with_a_warning() {
    for (mode, indices, kept) in [(4, &[0, 1, 2, 3][..], 1), (5, &[0, 1], 0), (6, &[0], 0)] {
        let model = with_mode(mode, Some(indices)).load();
        assert_eq!(model.meshes[0].primitives[0].triangle_count(), kept);
        let place = "mesh 0 'Body', primitive 0".to_owned();
        assert_eq!(model.warnings, [Warning::IncompleteTriangle { place }]);
    }
}

#[test]
fn a_primitive_without_positions_is_left_out_with_a_warning() {
    let glb = Glb::with_primitive(|glb| json!({ "attributes": { "NORMAL": glb.triangle_positions() } }));
    assert_eq!(glb.warnings(), ["mesh 0 'Body', primitive 0: left out, as it has no positions"]);
}

#[test]
fn indices_have_8_16_or_32_bits_and_are_in_range() {
    let with_indices = |bytes: &[u8], component, shape: &str| {
        Glb::with_primitive(|glb| {
            let (positions, normals) = (glb.floats(&SQUARE), glb.floats(&[[0.0, 0.0, 1.0]; 5]));
            let indices = glb.accessor(bytes, component, shape, 3);
            json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": indices })
        })
    };
    assert_eq!(with_indices(&[4, 0, 2], UNSIGNED_BYTE, "SCALAR").primitive().indices, [4, 0, 2]);
    let words: Vec<u8> = [4_u32, 0, 2].iter().flat_map(|index| index.to_le_bytes()).collect();
    assert_eq!(with_indices(&words, UNSIGNED_INT, "SCALAR").primitive().indices, [4, 0, 2]);
    let problem = with_indices(&[5, 0, 2], UNSIGNED_BYTE, "SCALAR").expect_problem(&[
        "mesh 0 'Body', primitive 0, accessor 2: the vertex 5 is out of range, as there are 5",
    ]);
    assert!(matches!(problem, Problem::OutOfRange { index: 5, count: 5, .. }));
    let problem =
        with_indices(&words, FLOAT, "SCALAR").expect_problem(&["SCALAR of FLOAT", "unsigned integers"]);
    assert!(matches!(problem, Problem::AccessorType { .. }));
    assert!(matches!(with_indices(&[0; 6], UNSIGNED_BYTE, "VEC2").problem(), Problem::AccessorType { .. }));
}

#[test]
fn missing_normals_are_flat() {
    let glb = Glb::with_primitive(|glb| {
        let positions = glb.floats(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]]);
        let tangents = glb.floats(&[[1.0, 0.0, 0.0, 1.0]; 4]);
        let indices = glb.indices(&[0, 1, 2, 0, 2, 3, 1, 1, 1]);
        json!({ "attributes": { "POSITION": positions, "TANGENT": tangents }, "indices": indices })
    });
    let primitive = glb.primitive();
    assert_eq!(primitive.indices, (0..9).collect::<Vec<_>>());
    let normals: Vec<_> =
        primitive.normals.chunks(3).map(|triangle| [triangle[0], triangle[1], triangle[2]]).collect();
    assert_eq!(normals, [[[0.0, 0.0, 1.0]; 3], [[1.0, 0.0, 0.0]; 3], [[0.0, 0.0, 1.0]; 3]]);
    assert_eq!(primitive.positions.get(5), Some([0.0, 0.0, 4.0]));
    assert!(primitive.tangents.is_empty(), "tangents of the file are ignored with flat normals");
}

#[test]
fn normals_and_tangents_become_unit_vectors() {
    let primitive = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        let normals = glb.floats(&[[0.0, 0.0, 5.0], [0.0, 3.0, 4.0], [0.0, 0.0, 0.0]]);
        let tangents = glb.floats(&[[2.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0], [1.0, 0.0, 0.0, -0.5]]);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals, "TANGENT": tangents } })
    })
    .primitive();
    assert_eq!(primitive.normals, [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]);
    assert_eq!(primitive.tangents, [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0], [1.0, 0.0, 0.0, -1.0]]);
}

#[test]
fn colors_and_sets_of_texture_coordinates_have_all_their_types() {
    let primitive = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 3]);
        let first = glb.floats(&[[0.0, 1.0], [0.5, 2.0], [-1.0, 0.25]]);
        let second = glb.accessor(&[0, 255, 51, 0, 0, 0], UNSIGNED_BYTE, "VEC2", 3);
        glb.json["accessors"][second]["normalized"] = json!(true);
        let shorts: Vec<u8> = [0, 65535, 13107, 0, 0, 0_u16].iter().flat_map(|n| n.to_le_bytes()).collect();
        let third = glb.accessor(&shorts, UNSIGNED_SHORT, "VEC2", 3);
        glb.json["accessors"][third]["normalized"] = json!(true);
        let colors = glb.accessor(&[255, 0, 51, 0, 0, 0, 0, 0, 0, 0, 0, 0], UNSIGNED_BYTE, "VEC3", 3);
        glb.json["accessors"][colors]["normalized"] = json!(true);
        let colors_view = &mut glb.json["accessors"][colors];
        colors_view["count"] = json!(3);
        json!({ "attributes": {
            "POSITION": positions, "NORMAL": normals, "COLOR_0": colors,
            "TEXCOORD_0": first, "TEXCOORD_1": second, "TEXCOORD_2": third,
        } })
    })
    .primitive();
    assert_eq!(primitive.tex_coords[0], [[0.0, 1.0], [0.5, 2.0], [-1.0, 0.25]]);
    assert_eq!(primitive.tex_coords[1], [[0.0, 1.0], [0.2, 0.0], [0.0, 0.0]]);
    assert_eq!(primitive.tex_coords[2], [[0.0, 1.0], [0.2, 0.0], [0.0, 0.0]]);
    assert_eq!(primitive.colors, [[1.0, 0.0, 0.2, 1.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]);
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let primitive = Glb::with_primitive(|glb| {
        let vertices: Vec<f32> = (0..3).flat_map(|v| [v as f32, 10.0, 20.0, 0.0, 0.0, 1.0]).collect();
        let view = glb.view(bytemuck::cast_slice(&vertices));
        glb.json["bufferViews"][view]["byteStride"] = json!(24);
        let mut accessor = |offset| {
            let object = json!({
                "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "type": "VEC3", "count": 3
            });
            glb.push("accessors", object)
        };
        json!({ "attributes": { "POSITION": accessor(0), "NORMAL": accessor(12) } })
    })
    .primitive();
    assert_eq!(
        primitive.positions,
        Positions::F32(vec![[0.0, 10.0, 20.0], [1.0, 10.0, 20.0], [2.0, 10.0, 20.0]])
    );
    assert_eq!(primitive.normals, [[0.0, 0.0, 1.0]; 3]);
}

#[test]
fn attributes_that_the_model_has_no_place_for_are_warned_of() {
    let glb = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        let more = glb.floats(&[[0.0, 0.0, 0.0, 1.0]; 3]);
        json!({ "attributes": { "POSITION": positions, "COLOR_1": more, "_HEAT": more, "TEXCOORD_9": more } })
    });
    let mut warnings = glb.warnings();
    warnings.sort();
    let ignored = ["COLOR_1", "TEXCOORD_9", "_HEAT"];
    assert_eq!(
        warnings,
        ignored.map(|name| format!("mesh 0 'Body', primitive 0: attribute {name} is ignored"))
    );
}

#[test]
fn types_that_an_attribute_may_not_have_are_refused() {
    for (attribute, shape, component) in [
        ("NORMAL", "VEC2", FLOAT),
        ("NORMAL", "VEC3", BYTE),
        ("TANGENT", "VEC3", FLOAT),
        ("TEXCOORD_0", "VEC3", FLOAT),
        ("TEXCOORD_0", "VEC2", UNSIGNED_BYTE),
        ("COLOR_0", "VEC2", FLOAT),
        ("JOINTS_0", "VEC4", FLOAT),
        ("WEIGHTS_0", "VEC4", BYTE),
    ] {
        let glb = Glb::with_primitive(|glb| {
            let positions = glb.triangle_positions();
            let other = glb.accessor(&[0; 64], component, shape, 3);
            json!({ "attributes": { "POSITION": positions, attribute: other } })
        });
        assert!(matches!(glb.problem(), Problem::AccessorType { .. }), "{attribute} {shape} {component}");
    }
    let glb = Glb::with_primitive(
        |glb| json!({ "attributes": { "POSITION": glb.accessor(&[0; 24], UNSIGNED_SHORT, "VEC3", 3) } }),
    );
    glb.expect_problem(&["VEC3 of UNSIGNED_SHORT", "KHR_mesh_quantization"]);
}

#[test]
fn lists_of_other_lengths_and_numbers_that_are_not_finite_are_refused() {
    let glb = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        json!({ "attributes": { "POSITION": positions, "NORMAL": glb.floats(&[[0.0, 0.0, 1.0]; 2]) } })
    });
    let problem =
        glb.expect_problem(&["mesh 0 'Body', primitive 0, accessor 1 has 2 entries, but 3 are needed"]);
    assert!(matches!(problem, Problem::Count { found: 2, wanted: 3, .. }));
    for number in [f32::NAN, f32::INFINITY] {
        let glb = Glb::with_primitive(
            |glb| json!({ "attributes": { "POSITION": glb.floats(&[[0.0; 3], [0.0, number, 0.0], [0.0; 3]]) } }),
        );
        let problem = glb.expect_problem(&["accessor 0: element 1 is not finite"]);
        assert!(matches!(problem, Problem::NotFinite { .. }));
    }
}
