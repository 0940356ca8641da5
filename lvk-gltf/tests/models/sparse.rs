//! Sparse accessors.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::{Positions, Problem};
use serde_json::{Value, json};

use crate::glb::{FLOAT, Glb, UNSIGNED_SHORT};

/// Five positions, of which two are replaced.
fn sparse(with_base: bool, indices: &[u16]) -> Glb {
    Glb::with_primitive(|glb| {
        let base = glb.view(bytemuck::cast_slice(&[[1.0_f32, 2.0, 3.0]; 5]));
        let indices_view = glb.view(bytemuck::cast_slice(indices));
        let values = glb.view(bytemuck::cast_slice(&[[7.0_f32, 8.0, 9.0], [-1.0, 0.0, 1.0]]));
        let mut accessor = json!({ "componentType": FLOAT, "type": "VEC3", "count": 5, "sparse": {
            "count": indices.len(),
            "indices": { "bufferView": indices_view, "componentType": UNSIGNED_SHORT },
            "values": { "bufferView": values },
        } });
        if with_base {
            accessor["bufferView"] = json!(base);
        }
        let positions = glb.push("accessors", accessor);
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 5]);
        let indices = glb.indices(&[0, 1, 4]);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": indices })
    })
}

#[test]
fn values_take_the_place_of_elements_or_of_zeros() {
    for (with_base, base) in [(true, [1.0, 2.0, 3.0]), (false, [0.0; 3])] {
        let wanted = vec![base, [7.0, 8.0, 9.0], base, base, [-1.0, 0.0, 1.0]];
        assert_eq!(sparse(with_base, &[1, 4]).primitive().positions, Positions::F32(wanted));
    }
}

#[test]
fn wrong_sparse_parts_are_refused() {
    let problem =
        sparse(true, &[1, 5]).expect_problem(&["accessor 0: sparse index 5 is out of range, as there are 5"]);
    assert!(matches!(problem, Problem::OutOfRange { .. }));
    sparse(true, &[4, 1]).expect_problem(&["its sparse indices do not rise"]);
    sparse(true, &[1, 1]).expect_problem(&["its sparse indices do not rise"]);
    let change = |pointer: &str, value: Value| {
        let mut glb = sparse(true, &[1, 4]);
        *glb.at(pointer) = value;
        glb.problem()
    };
    assert!(matches!(change("/accessors/0/sparse/count", json!(6)), Problem::Count { .. }));
    assert!(matches!(change("/accessors/0/sparse/count", json!(3)), Problem::Truncated { .. }));
    assert!(matches!(
        change("/accessors/0/sparse/indices/componentType", json!(FLOAT)),
        Problem::Rule { .. }
    ));
    assert!(matches!(change("/accessors/0/sparse/values/bufferView", json!(99)), Problem::Rule { .. }));
}
