//! `KHR_mesh_quantization`: positions keep their format, other attributes become floats.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::Positions;
use serde_json::json;

use crate::glb::{BYTE, Glb, SHORT, UNSIGNED_BYTE, UNSIGNED_SHORT, assert_close};

/// A triangle whose positions have these bytes, padded to four bytes a vertex, and flat normals.
fn with_positions(bytes: &[u8], component: u32, normalized: bool) -> Positions {
    let mut glb = Glb::with_primitive(|glb| {
        let positions = glb.accessor(bytes, component, "VEC3", 3);
        glb.json["accessors"][positions]["normalized"] = json!(normalized);
        glb.json["bufferViews"][positions]["byteStride"] = json!(bytes.len() / 3);
        let normals = glb.floats(&[[0.0, 0.0, 1.0]; 3]);
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals } })
    });
    glb.uses("KHR_mesh_quantization").primitive().positions
}

#[test]
fn positions_keep_their_format() {
    let shorts = [[-32768_i16, 32767, 16384, 9], [0, 1, -1, 9], [-32767, 5, 6, 9]];
    let kept = shorts.map(|[x, y, z, _]| [x, y, z, 0]).to_vec();
    let bytes: &[u8] = bytemuck::cast_slice(&shorts);
    let snorm = with_positions(bytes, SHORT, true);
    assert_eq!(snorm, Positions::Snorm16(kept.clone()));
    assert_eq!((snorm.stride_bytes(), snorm.bytes().len()), (8, 24));
    // The specification's equations, in f64.
    let wanted = [-1.0, 1.0, 16384.0 / 32767.0];
    assert_close(&snorm.get(0).unwrap(), &wanted, 1e-7);
    let sint = with_positions(bytes, SHORT, false);
    assert_eq!(sint, Positions::Sint16(kept));
    assert_eq!(sint.get(0), Some([-32768.0, 32767.0, 16384.0]));
    let unorm = with_positions(bytes, UNSIGNED_SHORT, true);
    assert_close(&unorm.get(0).unwrap(), &[32768.0 / 65535.0, 32767.0 / 65535.0, 16384.0 / 65535.0], 1e-7);
    assert_eq!(with_positions(bytes, UNSIGNED_SHORT, false).get(1), Some([0.0, 1.0, 65535.0]));

    let bytes = [0x80, 127, 64, 9, 0, 1, 255, 9, 2, 3, 4, 9];
    let snorm = with_positions(&bytes, BYTE, true);
    assert_eq!(snorm, Positions::Snorm8(vec![[-128, 127, 64, 0], [0, 1, -1, 0], [2, 3, 4, 0]]));
    assert_eq!(snorm.stride_bytes(), 4);
    assert_close(&snorm.get(0).unwrap(), &[-1.0, 1.0, 64.0 / 127.0], 1e-7);
    assert_eq!(with_positions(&bytes, BYTE, false).get(1), Some([0.0, 1.0, -1.0]));
    assert_close(
        &with_positions(&bytes, UNSIGNED_BYTE, true).get(1).unwrap(),
        &[0.0, 1.0 / 255.0, 1.0],
        1e-7,
    );
    assert_eq!(with_positions(&bytes, UNSIGNED_BYTE, false).get(1), Some([0.0, 1.0, 255.0]));
}

#[test]
fn other_attributes_become_floats() {
    let mut glb = Glb::with_primitive(|glb| {
        let positions = glb.triangle_positions();
        let mut small = |bytes: &[u8], component, shape, normalized| {
            let accessor = glb.accessor(bytes, component, shape, 3);
            glb.json["accessors"][accessor]["normalized"] = json!(normalized);
            glb.json["bufferViews"][accessor]["byteStride"] = json!(bytes.len() / 3);
            accessor
        };
        let normals = small(&[0, 0, 127, 0, 127, 0, 0, 0, 0, 129, 0, 0], BYTE, "VEC3", true);
        let tangents = small(&[127, 0, 0, 127, 0, 127, 0, 129, 127, 0, 0, 127], BYTE, "VEC4", true);
        let coordinates: [[u16; 2]; 3] = [[0, 4096], [7, 65535], [1, 2]];
        let coordinates = small(bytemuck::cast_slice(&coordinates), UNSIGNED_SHORT, "VEC2", false);
        json!({ "attributes": {
            "POSITION": positions, "NORMAL": normals, "TANGENT": tangents, "TEXCOORD_0": coordinates
        } })
    });
    let primitive = glb.uses("KHR_mesh_quantization").primitive();
    assert_eq!(primitive.normals, [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]);
    assert_eq!(primitive.tangents, [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, -1.0], [1.0, 0.0, 0.0, 1.0]]);
    assert_eq!(primitive.tex_coords[0], [[0.0, 4096.0], [7.0, 65535.0], [1.0, 2.0]]);
}
