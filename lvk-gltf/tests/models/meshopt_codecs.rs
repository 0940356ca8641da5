//! `EXT_meshopt_compression` and `KHR_meshopt_compression`: a compressed model is the model that was compressed.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::{Positions, Problem};
use serde_json::json;

use crate::glb::{FLOAT, Glb, SHORT, UNSIGNED_SHORT};

const POSITIONS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 0.5]];
const NORMALS: [[i16; 4]; 4] = [[0, 0, 32767, 0]; 4];
const INDICES: [u32; 6] = [0, 1, 2, 2, 1, 3];

/// Compressed data of one view.
struct Compressed {
    data: Vec<u8>,
    stride: usize,
    count: usize,
    mode: &'static str,
    filter: &'static str,
}

impl Glb {
    /// Adds a view of compressed data, whose plain bytes would lie in a second buffer that is not there.
    fn compressed_view(&mut self, extension: &str, compressed: &Compressed) -> usize {
        let Compressed { data, stride, count, mode, filter } = compressed;
        let start = self.bin.len();
        self.bin.extend(data);
        self.push(
            "bufferViews",
            json!({ "buffer": 1, "byteLength": stride * count, "extensions": { extension: {
                "buffer": 0, "byteOffset": start, "byteLength": data.len(), "byteStride": stride, "count": count,
                "mode": mode, "filter": filter,
            } } }),
        )
    }
}

/// A square with positions, normals through a filter, and indices, all compressed.
fn compressed(extension: &str, version: i32) -> Glb {
    let mut glb = Glb::with_primitive(|glb| {
        let encode = |data: &[[u8; 12]]| meshopt::encode_vertex_buffer_level(data, 2, Some(version)).unwrap();
        let positions = encode(bytemuck::cast_slice(&POSITIONS));
        let axes = NORMALS.map(|normal| normal.map(|n| f32::from(n) / 32767.0));
        let normals: Vec<[i16; 4]> = meshopt::encode_filter_oct(&axes, 16);
        let normals = meshopt::encode_vertex_buffer_level(&normals, 2, Some(version)).unwrap();
        let indices = meshopt::encode_index_buffer(&INDICES, 4).unwrap();
        let mut accessor = |data, stride, count, mode, filter, component: u32, shape: &str| {
            let view = glb.compressed_view(extension, &Compressed { data, stride, count, mode, filter });
            if mode == "ATTRIBUTES" {
                glb.json["bufferViews"][view]["byteStride"] = json!(stride);
            }
            let normalized = component == SHORT;
            glb.push(
                "accessors",
                json!({ "bufferView": view, "componentType": component, "type": shape, "count": count,
                        "normalized": normalized }),
            )
        };
        let positions = accessor(positions, 12, 4, "ATTRIBUTES", "NONE", FLOAT, "VEC3");
        let normals = accessor(normals, 8, 4, "ATTRIBUTES", "OCTAHEDRAL", SHORT, "VEC3");
        let indices = accessor(indices, 2, 6, "TRIANGLES", "NONE", UNSIGNED_SHORT, "SCALAR");
        json!({ "attributes": { "POSITION": positions, "NORMAL": normals }, "indices": indices })
    });
    let bytes = glb.bin.len();
    glb.json["buffers"] = json!([{ "byteLength": bytes }, { "byteLength": 92, "extensions": { extension: { "fallback": true } } }]);
    glb.uses(extension).uses("KHR_mesh_quantization");
    glb.push("extensionsRequired", json!(extension));
    glb
}

#[test]
fn compressed_views_are_decoded() {
    for (extension, version) in [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)] {
        let primitive = compressed(extension, version).primitive();
        assert_eq!(primitive.positions, Positions::F32(POSITIONS.to_vec()));
        assert_eq!(primitive.normals, [[0.0, 0.0, 1.0]; 4]);
        assert_eq!(primitive.vertex_count(), 4);
        // The codec may turn the corners of a triangle.
        let turned = |corners: &[u32]| {
            let least = (0..3).min_by_key(|k| corners[*k]).unwrap();
            [0, 1, 2].map(|k| corners[(least + k) % 3])
        };
        let triangles = |indices: &[u32]| indices.chunks(3).map(turned).collect::<Vec<_>>();
        assert_eq!(triangles(&primitive.indices), triangles(&INDICES));
    }
}

#[test]
fn damaged_data_is_refused() {
    let glb = compressed("EXT_meshopt_compression", 0);
    let view = "/bufferViews/0/extensions/EXT_meshopt_compression";
    for (property, value) in [("count", json!(3)), ("byteStride", json!(10)), ("filter", json!("QUATERNION"))]
    {
        let mut glb = glb.clone();
        glb.at(view)[property] = value;
        assert!(matches!(glb.problem(), Problem::Compressed { .. }), "{property}");
    }
    let mut header = glb.clone();
    header.bin[0] = 0xb0;
    header.expect_problem(&["buffer view 0: the data of meshopt compression is damaged (its header"]);
    let mut outside = glb.clone();
    outside.at(view)["byteLength"] = json!(100_000);
    assert!(matches!(outside.problem(), Problem::Truncated { .. }));
    let mut unknown = glb;
    unknown.at(view)["mode"] = json!("MAGIC");
    assert!(matches!(unknown.problem(), Problem::Json { .. }));
}
