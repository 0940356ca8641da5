//! Features of a model that the viewer ignores, or shows otherwise.

use lvk_gltf::{Model, Projection};

/// Sets of texture coordinates that shaders read.
const SETS: usize = 2;

/// Returns a warning for each material with a texture of occlusion or of thickness, for each texture with a further set of coordinates, and for
/// each camera without a perspective.
pub(super) fn warnings(model: &Model) -> Vec<String> {
    let mut found = Vec::new();
    for (place, material) in model.materials.iter().enumerate() {
        let name = material.name.as_deref().unwrap_or("without a name");
        if material.occlusion_texture.is_some() && material.occlusion_strength > 0.0 {
            found.push(format!(
                "material {place} '{name}': occlusionTexture is ignored, as rays find occlusion"
            ));
        }
        if material.volume.as_ref().is_some_and(|volume| volume.thickness_texture.is_some()) {
            found.push(format!(
                "material {place} '{name}': thicknessTexture is ignored, as rays measure their way through a volume"
            ));
        }
        let is_shown = |texture: &str| !["occlusionTexture", "thicknessTexture"].contains(&texture);
        let shown = material.textures().filter(|(texture, _)| is_shown(texture));
        for (texture, reference) in shown.filter(|(_, reference)| reference.tex_coord >= SETS) {
            found.push(format!(
                "material {place} '{name}': {texture} wants texture coordinates {}, and has those of {}; write at most \
                 {SETS} sets",
                reference.tex_coord,
                SETS - 1
            ));
        }
    }
    for (place, camera) in model.cameras.iter().enumerate() {
        if matches!(camera.projection, Projection::Orthographic { .. }) {
            let name = camera.name.as_deref().unwrap_or("without a name");
            found.push(format!(
                "camera {place} '{name}': it is orthographic, and shown by a perspective of 5 degrees from far away"
            ));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use lvk_gltf::{Camera, Material, TextureRef, Volume};

    use super::*;

    #[test]
    fn occlusion_thickness_further_sets_and_orthographic_cameras_are_told() {
        let texture = |tex_coord| Some(TextureRef { image: 0, sampler: 0, tex_coord, transform: None });
        let named = |name: &str| Some(name.to_owned());
        let materials = vec![
            Material { name: named("shown"), base_color_texture: texture(1), ..Material::default() },
            Material { name: named("wall"), occlusion_texture: texture(2), ..Material::default() },
            Material { emissive_texture: texture(2), ..Material::default() },
        ];
        let volume = |thickness_texture| Volume {
            thickness: 1.0,
            thickness_texture,
            attenuation_distance: f32::INFINITY,
            attenuation_color: [1.0; 3],
        };
        let glass = [volume(None), volume(texture(0))];
        let materials = materials.into_iter().chain(glass.map(|volume| Material {
            name: named("glass"),
            volume: Some(volume),
            ..Material::default()
        }));
        let orthographic = Projection::Orthographic { xmag: 1.0, ymag: 1.0, znear: 0.0, zfar: 1.0 };
        let cameras = vec![Camera { name: named("plan"), projection: orthographic }];
        let told = super::warnings(&Model { materials: materials.collect(), cameras, ..Model::default() });
        assert_eq!(told.len(), 4, "{told:?}");
        assert!(told[0].starts_with("material 1 'wall': occlusionTexture is ignored"), "{told:?}");
        assert!(told[1].starts_with("material 2 'without a name': emissiveTexture wants"), "{told:?}");
        assert!(told[2].starts_with("material 4 'glass': thicknessTexture is ignored"), "{told:?}");
        assert!(told[3].starts_with("camera 0 'plan': it is orthographic"), "{told:?}");
    }
}
