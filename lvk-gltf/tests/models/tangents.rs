//! Tangents by MikkTSpace where a material needs them.

use glam::{DVec2, DVec3, Vec3};
use lvk_gltf::Primitive;
use serde_json::{Value, json};

use crate::glb::Glb;
use crate::images::png;

/// A mesh with a material that has this normal map.
fn with_normal_map(
    positions: &[[f32; 3]],
    tex_coords: &[[f32; 2]],
    indices: &[u16],
    normal: [f32; 3],
) -> Glb {
    let mut glb = Glb::with_primitive(|glb| {
        let attributes = json!({
            "POSITION": glb.floats(positions), "NORMAL": glb.floats(&vec![normal; positions.len()]),
            "TEXCOORD_0": glb.floats(tex_coords),
        });
        json!({ "attributes": attributes, "indices": glb.indices(indices), "material": 0 })
    });
    let view = glb.view(&png(1, 1, &[128, 128, 255, 255]));
    glb.push("images", json!({ "bufferView": view }));
    glb.push("textures", json!({ "source": 0 }));
    glb.push("materials", json!({ "normalTexture": { "index": 0 } }));
    glb
}

const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

/// Tangent and sign of a triangle by the gradient of its texture coordinates, in f64. The image's rows go down with the
/// second coordinate, and the bitangent points up in the image.
fn gradient(primitive: &Primitive, triangle: usize) -> (DVec3, f64) {
    let corner = |k: usize| primitive.indices[3 * triangle + k] as usize;
    let position = |k| Vec3::from(primitive.positions.get(corner(k)).unwrap_or_default()).as_dvec3();
    let coordinates = |k| DVec2::from(primitive.tex_coords[0][corner(k)].map(f64::from));
    let (p1, p2) = (position(1) - position(0), position(2) - position(0));
    let (t1, t2) = (coordinates(1) - coordinates(0), coordinates(2) - coordinates(0));
    let area = t1.perp_dot(t2);
    let tangent = (p1 * t2.y - p2 * t1.y) / area;
    let up = (p1 * t2.x - p2 * t1.x) / area; // against the second coordinate
    let normal = Vec3::from(primitive.normals[corner(0)]).as_dvec3();
    (tangent.normalize(), normal.cross(tangent).dot(up).signum())
}

#[test]
fn tangents_follow_the_texture_coordinates() {
    for (tex_coords, sign) in [
        // As images are laid on a wall: up is up.
        ([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], 1.0),
        // Mirrored.
        ([[1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0]], -1.0),
        // Turned and scaled.
        ([[0.0, 0.0], [0.0, 3.0], [2.0, 3.0], [2.0, 0.0]], 1.0),
    ] {
        let primitive = with_normal_map(&SQUARE, &tex_coords, &INDICES, [0.0, 0.0, 1.0]).primitive();
        assert_eq!(primitive.vertex_count(), 4);
        for triangle in 0..2 {
            let (tangent, wanted_sign) = gradient(&primitive, triangle);
            assert_eq!(wanted_sign, sign);
            for corner in &primitive.indices[3 * triangle..3 * triangle + 3] {
                let [x, y, z, w] = primitive.tangents[*corner as usize];
                let difference = (Vec3::new(x, y, z).as_dvec3() - tangent).length();
                assert!(difference < 1e-6 && f64::from(w) == sign, "{tex_coords:?} {:?}", primitive.tangents);
            }
        }
    }
}

#[test]
fn a_vertex_with_two_tangents_is_split() {
    // A strip of two squares, the second one mirrored at the seam.
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
    ];
    let tex_coords = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0]];
    let indices = [0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2];
    let primitive = with_normal_map(&positions, &tex_coords, &indices, [0.0, 0.0, 1.0]).primitive();
    assert_eq!(primitive.vertex_count(), 8, "the two vertices of the seam are doubled");
    assert_eq!((primitive.tangents.len(), primitive.normals.len(), primitive.tex_coords[0].len()), (8, 8, 8));
    for triangle in 0..4 {
        let (tangent, sign) = gradient(&primitive, triangle);
        assert_eq!(sign, if triangle < 2 { 1.0 } else { -1.0 });
        for k in 0..3 {
            let corner = primitive.indices[3 * triangle + k] as usize;
            let [x, y, z, w] = primitive.tangents[corner];
            assert!((Vec3::new(x, y, z).as_dvec3() - tangent).length() < 1e-6 && f64::from(w) == sign);
            let place = positions[usize::from(indices[3 * triangle + k])];
            assert_eq!(primitive.positions.get(corner), Some(place));
        }
    }
}

#[test]
fn triangles_without_area_have_some_tangent() {
    let normal = [0.6, 0.0, 0.8];
    let primitive = with_normal_map(&SQUARE, &[[0.5, 0.5]; 4], &INDICES, normal).primitive();
    for [x, y, z, w] in primitive.tangents {
        let tangent = Vec3::new(x, y, z);
        assert!((tangent.length() - 1.0).abs() < 1e-5 && w.abs() == 1.0, "{tangent}");
        assert!(tangent.dot(Vec3::from(normal)).abs() < 1e-5, "{tangent}");
    }
}

#[test]
fn only_materials_that_need_tangents_get_them() {
    let tex_coords = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let with_material = |material: Value| {
        let mut glb = with_normal_map(&SQUARE, &tex_coords, &INDICES, [0.0, 0.0, 1.0]);
        *glb.at("/materials/0") = material;
        glb.load().meshes.remove(0).primitives.remove(0).tangents.len()
    };
    assert_eq!(with_material(json!({})), 0);
    assert_eq!(with_material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } })), 0);
    assert_eq!(with_material(json!({ "extensions": { "KHR_materials_anisotropy": {} } })), 4);
    let clearcoat = json!({ "KHR_materials_clearcoat": { "clearcoatNormalTexture": { "index": 0 } } });
    assert_eq!(with_material(json!({ "extensions": clearcoat })), 4);
    assert_eq!(
        with_material(json!({ "normalTexture": { "index": 0, "texCoord": 1 } })),
        0,
        "it has no such set"
    );
}

#[test]
fn tangents_of_the_file_are_kept() {
    let mut glb = with_normal_map(&SQUARE, &[[0.0; 2]; 4], &INDICES, [0.0, 0.0, 1.0]);
    let tangents = glb.floats(&[[0.0, 1.0, 0.0, -1.0]; 4]);
    glb.at("/meshes/0/primitives/0/attributes")["TANGENT"] = json!(tangents);
    assert_eq!(glb.primitive().tangents, [[0.0, 1.0, 0.0, -1.0]; 4]);
}
