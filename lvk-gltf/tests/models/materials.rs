//! Materials and their extensions.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_gltf::{
    AlphaMode, Anisotropy, Clearcoat, ColorSpace, Filter, Iridescence, Material, Problem, Sampler, Sheen,
    Specular, TextureRef, TextureTransform, Transmission, Volume, Wrap,
};
use serde_json::{Value, json};

use crate::glb::{Glb, assert_close};
use crate::images::png;

/// A file with a material and two textures, of which the second has a sampler of its own.
fn with_material(material: Value) -> Glb {
    let mut glb = Glb::triangle();
    for texels in [[[255, 0, 0, 255]], [[0, 255, 0, 255]]] {
        let view = glb.view(&png(1, 1, texels.as_flattened()));
        glb.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    }
    let sampler = json!({ "magFilter": 9728, "minFilter": 9985, "wrapS": 33071, "wrapT": 33648 });
    glb.push("samplers", sampler);
    glb.push("textures", json!({ "source": 0 }));
    glb.push("textures", json!({ "source": 1, "sampler": 0 }));
    glb.push("materials", material);
    glb
}

fn material(json: Value) -> Material {
    with_material(json).load_cleanly().materials.remove(0)
}

/// A texture as the first material to use it sees it.
fn texture(image: usize, sampler: usize) -> Option<TextureRef> {
    Some(TextureRef { image, sampler, tex_coord: 0, transform: None })
}

#[test]
fn an_empty_material_is_the_default_one() {
    assert_eq!(material(json!({})), Material::default());
}

#[test]
fn all_properties_of_the_core_are_read() {
    let glb = with_material(json!({
        "name": "Paint",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "baseColorTexture": { "index": 0 },
            "metallicFactor": 0.5, "roughnessFactor": 0.6, "metallicRoughnessTexture": { "index": 1, "texCoord": 3 },
        },
        "normalTexture": { "index": 1, "scale": -2.0 },
        "occlusionTexture": { "index": 1, "strength": 0.7, "texCoord": 1 },
        "emissiveFactor": [0.8, 0.9, 1.0], "emissiveTexture": { "index": 0 },
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
    }));
    let model = glb.load_cleanly();
    let linear = |tex_coord| Some(TextureRef { image: 1, sampler: 0, tex_coord, transform: None });
    let wanted = Material {
        name: Some("Paint".into()),
        base_color: [0.1, 0.2, 0.3, 0.4],
        base_color_texture: texture(0, 1),
        metallic: 0.5,
        roughness: 0.6,
        metallic_roughness_texture: linear(3),
        normal_texture: linear(0),
        normal_scale: -2.0,
        occlusion_texture: linear(1),
        occlusion_strength: 0.7,
        emissive: [0.8, 0.9, 1.0],
        emissive_texture: texture(0, 1),
        alpha_mode: AlphaMode::Mask { cutoff: 0.25 },
        double_sided: true,
        ..Material::default()
    };
    assert_eq!(model.materials, [wanted]);
    let spaces: Vec<_> = model.images.iter().map(|image| (image.source, image.color_space)).collect();
    assert_eq!(spaces, [(0, ColorSpace::Srgb), (1, ColorSpace::Linear)]);
    let own = Sampler {
        mag_filter: Filter::Nearest,
        min_filter: Filter::Linear,
        mip_filter: Some(Filter::Nearest),
        wrap_u: Wrap::ClampToEdge,
        wrap_v: Wrap::MirroredRepeat,
    };
    assert_eq!(model.samplers, [own, Sampler::default()]);
    let names: Vec<_> = model.materials[0].textures().map(|(name, _)| name).collect();
    let wanted = [
        "baseColorTexture",
        "metallicRoughnessTexture",
        "normalTexture",
        "occlusionTexture",
        "emissiveTexture",
    ];
    assert_eq!(names, wanted);
}

#[test]
fn alpha_modes_are_opaque_mask_and_blend() {
    assert_eq!(material(json!({ "alphaMode": "OPAQUE", "alphaCutoff": 0.1 })).alpha_mode, AlphaMode::Opaque);
    assert_eq!(material(json!({ "alphaMode": "MASK" })).alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert_eq!(material(json!({ "alphaMode": "BLEND" })).alpha_mode, AlphaMode::Blend);
    with_material(json!({ "alphaMode": "DITHER" }))
        .expect_problem(&["materials[0].alphaMode", "not allowed"]);
}

#[test]
fn extensions_of_materials_are_read() {
    let extensions = json!({
        "KHR_materials_unlit": {},
        "KHR_materials_emissive_strength": { "emissiveStrength": 5.0 },
        "KHR_materials_ior": { "ior": 1.4 },
        "KHR_materials_transmission": { "transmissionFactor": 0.1, "transmissionTexture": { "index": 1 } },
        "KHR_materials_volume": { "thicknessFactor": 0.2, "thicknessTexture": { "index": 1 },
            "attenuationDistance": 3.0, "attenuationColor": [0.1, 0.2, 0.3] },
        "KHR_materials_clearcoat": { "clearcoatFactor": 0.3, "clearcoatTexture": { "index": 1 },
            "clearcoatRoughnessFactor": 0.4, "clearcoatRoughnessTexture": { "index": 1 },
            "clearcoatNormalTexture": { "index": 1, "scale": 0.5 } },
        "KHR_materials_sheen": { "sheenColorFactor": [0.4, 0.5, 0.6], "sheenColorTexture": { "index": 0 },
            "sheenRoughnessFactor": 0.7, "sheenRoughnessTexture": { "index": 1 } },
        "KHR_materials_specular": { "specularFactor": 0.6, "specularTexture": { "index": 1 },
            "specularColorFactor": [1.5, 0.5, 0.25], "specularColorTexture": { "index": 0 } },
        "KHR_materials_anisotropy": { "anisotropyStrength": 0.8, "anisotropyRotation": -4.0,
            "anisotropyTexture": { "index": 1 } },
        "KHR_materials_iridescence": { "iridescenceFactor": 0.9, "iridescenceTexture": { "index": 1 },
            "iridescenceIor": 1.6, "iridescenceThicknessMinimum": 200.0, "iridescenceThicknessMaximum": 500.0,
            "iridescenceThicknessTexture": { "index": 1 } },
    });
    let mut glb = with_material(json!({ "extensions": extensions }));
    for extension in extensions.as_object().unwrap().keys() {
        glb.uses(extension);
        glb.push("extensionsRequired", json!(extension));
    }
    // Images in the order of their first use: the second file as data, the first one as colour.
    let (data, color) = (texture(0, 0), texture(1, 1));
    let wanted = Material {
        unlit: true,
        emissive_strength: 5.0,
        ior: 1.4,
        transmission: Some(Transmission { factor: 0.1, texture: data }),
        volume: Some(Volume {
            thickness: 0.2,
            thickness_texture: data,
            attenuation_distance: 3.0,
            attenuation_color: [0.1, 0.2, 0.3],
        }),
        clearcoat: Some(Clearcoat {
            factor: 0.3,
            texture: data,
            roughness: 0.4,
            roughness_texture: data,
            normal_texture: data,
            normal_scale: 0.5,
        }),
        sheen: Some(Sheen {
            color: [0.4, 0.5, 0.6],
            color_texture: color,
            roughness: 0.7,
            roughness_texture: data,
        }),
        specular: Some(Specular {
            factor: 0.6,
            texture: data,
            color: [1.5, 0.5, 0.25],
            color_texture: color,
        }),
        anisotropy: Some(Anisotropy { strength: 0.8, rotation: -4.0, texture: data }),
        iridescence: Some(Iridescence {
            factor: 0.9,
            texture: data,
            ior: 1.6,
            thickness_min: 200.0,
            thickness_max: 500.0,
            thickness_texture: data,
        }),
        ..Material::default()
    };
    assert_eq!(glb.load_cleanly().materials, [wanted]);
}

#[test]
fn extensions_of_materials_have_the_defaults_of_their_specifications() {
    let empty = json!({
        "KHR_materials_emissive_strength": {}, "KHR_materials_ior": {}, "KHR_materials_transmission": {},
        "KHR_materials_volume": {}, "KHR_materials_clearcoat": {}, "KHR_materials_sheen": {},
        "KHR_materials_specular": {}, "KHR_materials_anisotropy": {}, "KHR_materials_iridescence": {},
    });
    let wanted = Material {
        transmission: Some(Transmission { factor: 0.0, texture: None }),
        volume: Some(Volume {
            thickness: 0.0,
            thickness_texture: None,
            attenuation_distance: f32::INFINITY,
            attenuation_color: [1.0; 3],
        }),
        clearcoat: Some(Clearcoat {
            factor: 0.0,
            texture: None,
            roughness: 0.0,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }),
        sheen: Some(Sheen { color: [0.0; 3], color_texture: None, roughness: 0.0, roughness_texture: None }),
        specular: Some(Specular { factor: 1.0, texture: None, color: [1.0; 3], color_texture: None }),
        anisotropy: Some(Anisotropy { strength: 0.0, rotation: 0.0, texture: None }),
        iridescence: Some(Iridescence {
            factor: 0.0,
            texture: None,
            ior: 1.3,
            thickness_min: 100.0,
            thickness_max: 400.0,
            thickness_texture: None,
        }),
        ..Material::default()
    };
    assert_eq!(material(json!({ "extensions": empty })), wanted);
}

#[test]
fn texture_transforms_are_read_wherever_a_texture_is() {
    let transform = json!({ "KHR_texture_transform": { "offset": [0.5, 0.25], "rotation": 1.0, "scale": [2.0, 3.0], "texCoord": 1 } });
    let info = |index| json!({ "index": index, "texCoord": 0, "extensions": transform });
    let mut glb = with_material(json!({
        "pbrMetallicRoughness": { "baseColorTexture": info(0) },
        "normalTexture": info(1), "occlusionTexture": info(1), "emissiveTexture": info(0),
        "extensions": { "KHR_materials_clearcoat": { "clearcoatNormalTexture": info(1) },
                        "KHR_materials_transmission": { "transmissionTexture": info(1) } },
    }));
    glb.uses("KHR_texture_transform");
    let model = glb.load_cleanly();
    let wanted = TextureTransform { offset: [0.5, 0.25], rotation: 1.0, scale: [2.0, 3.0] };
    let textures: Vec<_> = model.materials[0].textures().collect();
    assert_eq!(textures.len(), 6);
    for (name, texture) in textures {
        assert_eq!((texture.transform, texture.tex_coord), (Some(wanted), 1), "{name}");
    }
    // The matrices of the extension's specification: translation, rotation, scale, applied in this order to a column.
    let (u, v, angle) = (0.3_f64, 0.7_f64, 1.0_f64);
    let (su, sv) = (2.0 * u, 3.0 * v);
    let rotated = [angle.cos() * su + angle.sin() * sv + 0.5, -angle.sin() * su + angle.cos() * sv + 0.25];
    assert_close(&wanted.apply([0.3, 0.7]), &rotated, 1e-6);
}

#[test]
fn numbers_out_of_range_are_corrected_with_a_warning_and_infinite_ones_refused() {
    let glb = with_material(json!({
        "pbrMetallicRoughness": { "metallicFactor": 2.0, "roughnessFactor": -1.0 }, "name": "Odd",
    }));
    let model = glb.load();
    assert_eq!((model.materials[0].metallic, model.materials[0].roughness), (1.0, 0.0));
    assert_eq!(
        glb.warnings(),
        [
            "material 0 'Odd': corrected metallicFactor 2, which is out of range",
            "material 0 'Odd': corrected roughnessFactor -1, which is out of range",
        ]
    );
    let glb = with_material(
        json!({ "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 1e300 } } }),
    );
    let problem = glb.expect_problem(&["material 0: emissiveStrength is not finite"]);
    assert!(matches!(problem, Problem::NotFinite { .. }));
}

#[test]
fn textures_out_of_range_are_refused() {
    let glb = with_material(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 2 } } }));
    glb.expect_problem(&["materials[0].pbrMetallicRoughness.baseColorTexture", "out of range"]);
    let glb = with_material(
        json!({ "extensions": { "KHR_materials_sheen": { "sheenColorTexture": { "index": 2 } } } }),
    );
    let problem = glb.expect_problem(&["material 0: texture 2 is out of range, as there are 2"]);
    assert!(matches!(problem, Problem::OutOfRange { .. }));
}

#[test]
fn a_texture_without_its_coordinates_is_warned_of() {
    let mut glb = with_material(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": 1 } } }),
    );
    glb.at("/meshes/0/primitives/0")["material"] = json!(0);
    assert_eq!(
        glb.warnings(),
        ["mesh 0 'Body', primitive 0: it has no TEXCOORD_1 for the baseColorTexture of its material"]
    );
}
