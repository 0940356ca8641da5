//! Materials of a model as shaders read them.

use glam::{Mat2, Vec2, Vec3};
use lvk_gltf::{AlphaMode, Iridescence, Material, Model, TextureRef, TextureTransform};

use super::layout::{GpuMaterial, GpuTextureSlot, NO_TEXTURE, flag_if, material_flag, slot};
use super::textures::GpuTextures;

/// Materials and the texture slots that they name.
pub(crate) struct GpuMaterials {
    pub(crate) materials: Vec<GpuMaterial>,
    pub(crate) slots: Vec<GpuTextureSlot>,
}

impl GpuMaterials {
    /// The materials of a model, and the default material after them.
    pub(crate) fn new(model: &Model, textures: &GpuTextures) -> Self {
        let mut all = Self { materials: Vec::new(), slots: Vec::new() };
        for material in model.materials.iter().chain([&Material::default()]) {
            let material = all.material(material, textures);
            all.materials.push(material);
        }
        all
    }

    fn material(&mut self, material: &Material, textures: &GpuTextures) -> GpuMaterial {
        let emission = Vec3::from(material.emissive) * material.emissive_strength;
        let specular = material.specular.unwrap_or(DEFAULT_SPECULAR);
        let coat = material.clearcoat.as_ref();
        let sheen = material.sheen.as_ref();
        let (anisotropy, film) = (material.anisotropy.as_ref(), material.iridescence.as_ref());
        GpuMaterial {
            base_color: material.base_color,
            emission: emission.to_array(),
            metalness: material.metallic,
            extinction: extinction(material),
            roughness: material.roughness,
            specular_color: specular.color,
            specular: specular.factor,
            sheen_color: sheen.map_or([0.0; 3], |sheen| sheen.color),
            sheen_roughness: sheen.map_or(1.0, |sheen| sheen.roughness),
            transmission: transmission(material),
            ior: material.ior,
            alpha_cutoff: match material.alpha_mode {
                AlphaMode::Mask { cutoff } => cutoff,
                AlphaMode::Opaque | AlphaMode::Blend => 0.0,
            },
            normal_scale: material.normal_scale,
            coat: coat.map_or(0.0, |coat| coat.factor),
            coat_roughness: coat.map_or(0.0, |coat| coat.roughness),
            coat_normal_scale: coat.map_or(1.0, |coat| coat.normal_scale),
            anisotropy: anisotropy.map_or(0.0, |anisotropy| anisotropy.strength),
            anisotropy_direction: anisotropy.map_or([1.0, 0.0], |anisotropy| {
                let (sine, cosine) = anisotropy.rotation.sin_cos();
                [cosine, sine]
            }),
            film: film.map_or(0.0, |film| film.factor),
            film_ior: film.map_or(1.0, |film| film.ior),
            film_thickness: film.map_or([0.0; 2], film_thickness),
            flags: flags(material),
            slots: self.slots(material, textures),
        }
    }

    fn slots(&mut self, material: &Material, textures: &GpuTextures) -> [u32; slot::COUNT] {
        let mut slots = [NO_TEXTURE; slot::COUNT];
        for (place, texture) in textures_of(material) {
            if let Some(texture) = texture {
                slots[place] = self.slot(&texture, textures);
            }
        }
        slots
    }

    fn slot(&mut self, texture: &TextureRef, textures: &GpuTextures) -> u32 {
        let Some(slot) = textures.slot(texture) else { return NO_TEXTURE };
        let (columns, offset) = texture.transform.as_ref().map_or((Mat2::IDENTITY, Vec2::ZERO), affine);
        self.slots.push(GpuTextureSlot {
            set: texture.tex_coord.min(1) as u32,
            columns: columns.to_cols_array(),
            offset: offset.to_array(),
            ..slot
        });
        self.slots.len() as u32 - 1
    }
}

/// The textures that the viewer reads of a material, and their places among its slots.
pub(super) fn textures_of(material: &Material) -> [(usize, Option<TextureRef>); slot::COUNT] {
    let coat = material.clearcoat.as_ref();
    let (specular, sheen) = (material.specular.as_ref(), material.sheen.as_ref());
    let (transmission, film) = (material.transmission.as_ref(), material.iridescence.as_ref());
    [
        (slot::BASE_COLOR, material.base_color_texture),
        (slot::METAL_ROUGH, material.metallic_roughness_texture),
        (slot::NORMAL, material.normal_texture),
        (slot::EMISSION, material.emissive_texture),
        (slot::TRANSMISSION, transmission.and_then(|transmission| transmission.texture)),
        (slot::SPECULAR, specular.and_then(|specular| specular.texture)),
        (slot::SPECULAR_COLOR, specular.and_then(|specular| specular.color_texture)),
        (slot::COAT, coat.and_then(|coat| coat.texture)),
        (slot::COAT_ROUGHNESS, coat.and_then(|coat| coat.roughness_texture)),
        (slot::SHEEN_COLOR, sheen.and_then(|sheen| sheen.color_texture)),
        (slot::SHEEN_ROUGHNESS, sheen.and_then(|sheen| sheen.roughness_texture)),
        (slot::COAT_NORMAL, coat.and_then(|coat| coat.normal_texture)),
        (slot::ANISOTROPY, material.anisotropy.as_ref().and_then(|anisotropy| anisotropy.texture)),
        (slot::FILM, film.and_then(|film| film.texture)),
        (slot::FILM_THICKNESS, film.and_then(|film| film.thickness_texture)),
    ]
}

/// Nanometres of a film where its texture is 0 and where it is 1; without a texture the film is everywhere as thick as at most.
fn film_thickness(film: &Iridescence) -> [f32; 2] {
    [
        if film.thickness_texture.is_some() { film.thickness_min } else { film.thickness_max },
        film.thickness_max,
    ]
}

/// True if the surface has a direction.
fn has_tangents(material: &Material) -> bool {
    let coat_normal = material.clearcoat.as_ref().and_then(|coat| coat.normal_texture.as_ref());
    material.normal_texture.is_some() || coat_normal.is_some() || material.anisotropy.is_some()
}

const DEFAULT_SPECULAR: lvk_gltf::Specular =
    lvk_gltf::Specular { factor: 1.0, texture: None, color: [1.0; 3], color_texture: None };

/// The transform as columns and offset.
fn affine(transform: &TextureTransform) -> (Mat2, Vec2) {
    let at = |u, v| Vec2::from(transform.apply([u, v]));
    let offset = at(0.0, 0.0);
    (Mat2::from_cols(at(1.0, 0.0) - offset, at(0.0, 1.0) - offset), offset)
}

/// True if the eye does not see the back of a surface. What bounds a volume is seen from within, as through its front.
pub(super) fn is_single_sided(material: &Material) -> bool {
    !material.double_sided && (is_thin(material) || transmission(material) == 0.0)
}

/// True if there is no volume behind the surface.
pub(super) fn is_thin(material: &Material) -> bool {
    material.volume.as_ref().is_none_or(|volume| volume.thickness <= 0.0)
}

/// A dielectric whose index of refraction is 0 reflects everything, so that nothing passes.
pub(super) fn transmission(material: &Material) -> f32 {
    let factor = material.transmission.as_ref().map_or(0.0, |transmission| transmission.factor);
    if material.ior < 1.0 { 0.0 } else { factor }
}

/// What a volume takes from light, per unit of length: white light has the attenuation colour after the attenuation distance.
fn extinction(material: &Material) -> [f32; 3] {
    let Some(volume) = material.volume.as_ref().filter(|_| !is_thin(material)) else { return [0.0; 3] };
    let distance = volume.attenuation_distance;
    match distance.is_finite() && distance > 0.0 {
        true => volume.attenuation_color.map(|left| -left.clamp(1e-6, 1.0).ln() / distance),
        false => [0.0; 3],
    }
}

fn flags(material: &Material) -> u32 {
    let alpha = match material.alpha_mode {
        AlphaMode::Opaque => 0,
        AlphaMode::Mask { .. } => material_flag::ALPHA_MASK,
        AlphaMode::Blend => material_flag::ALPHA_BLEND,
    };
    alpha
        | flag_if(material.unlit, material_flag::UNLIT)
        | flag_if(is_thin(material), material_flag::THIN)
        | flag_if(has_tangents(material), material_flag::TANGENTS)
        | flag_if(has_extensions(material), material_flag::EXTENSIONS)
}

/// True if the surface needs more than its base colour, metalness, roughness, emission, normals and anisotropy.
fn has_extensions(material: &Material) -> bool {
    let Material { clearcoat, sheen, transmission, specular, iridescence, .. } = material;
    clearcoat.is_some()
        || sheen.is_some()
        || transmission.is_some()
        || specular.is_some()
        || iridescence.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_has_the_attenuation_colour_after_the_attenuation_distance() {
        let volume = lvk_gltf::Volume {
            thickness: 1.0,
            thickness_texture: None,
            attenuation_distance: 2.5,
            attenuation_color: [0.9, 0.5, 0.1],
        };
        let material = Material { volume: Some(volume), ..Material::default() };
        let left = extinction(&material).map(|extinction| (-extinction * 2.5).exp());
        assert!(
            left.iter().zip([0.9, 0.5, 0.1]).all(|(left, color)| (left - color).abs() < 1e-5),
            "{left:?}"
        );
        assert_eq!(extinction(&Material::default()), [0.0; 3]);
    }

    #[test]
    fn backs_are_hidden_from_the_eye_but_of_double_sided_materials_and_of_volumes() {
        let plain = Material::default();
        assert!(is_single_sided(&plain));
        assert!(!is_single_sided(&Material { double_sided: true, ..plain.clone() }));
        let transmission = Some(lvk_gltf::Transmission { factor: 1.0, texture: None });
        let pane = Material { transmission, ..plain.clone() };
        assert!(is_single_sided(&pane));
        let volume = lvk_gltf::Volume {
            thickness: 1.0,
            thickness_texture: None,
            attenuation_distance: f32::INFINITY,
            attenuation_color: [1.0; 3],
        };
        let opaque = Material { volume: Some(volume), ..plain };
        assert!(is_single_sided(&opaque));
        assert!(!is_single_sided(&Material { volume: Some(volume), ..pane }));
    }

    #[test]
    fn columns_and_offset_are_the_transform() {
        let transform = TextureTransform { offset: [0.3, -0.2], rotation: 0.7, scale: [2.0, 0.5] };
        let (columns, offset) = affine(&transform);
        let [u, v] = transform.apply([0.4, 0.9]);
        assert!((columns * Vec2::new(0.4, 0.9) + offset).distance(Vec2::new(u, v)) < 1e-6);
    }
}
