//! Materials.

use gltf::json::extensions::texture::TextureTransform as JsonTransform;
use gltf::json::material::{self as json, AlphaMode as JsonAlphaMode};
use gltf::json::texture::Info;
use gltf::json::validation::Checked;

use super::document::Document;
use super::extensions::{self, TextureInfo};
use super::place::place;
use super::textures::Textures;
use crate::{
    AlphaMode, Anisotropy, Clearcoat, ColorSpace, Iridescence, Material, Problem, Sheen, Specular,
    TextureRef, TextureTransform, Transmission, Volume, Warning,
};

/// Reads all materials. The textures that they use are listed in `textures`.
pub(super) fn read_materials(
    document: &Document,
    textures: &mut Textures<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Material>, Problem> {
    let mut materials = Vec::new();
    let none = extensions::Material::default();
    for (index, json) in document.root.materials.iter().enumerate() {
        let more = document.extensions.materials.get(index).unwrap_or(&none);
        let place = place("material", index, json.name.as_deref());
        materials.push(Reader { place, textures, warnings }.read(json, more)?);
    }
    Ok(materials)
}

struct Reader<'a, 'b> {
    place: String,
    textures: &'a mut Textures<'b>,
    warnings: &'a mut Vec<Warning>,
}

impl Reader<'_, '_> {
    fn read(mut self, json: &json::Material, more: &extensions::Material) -> Result<Material, Problem> {
        let mut material = self.metallic_roughness(&json.pbr_metallic_roughness)?;
        material.name.clone_from(&json.name);
        material.double_sided = json.double_sided;
        self.maps(json, more, &mut material)?;
        material.alpha_mode = match json.alpha_mode {
            Checked::Valid(JsonAlphaMode::Mask) => {
                let cutoff = json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
                AlphaMode::Mask { cutoff: self.at_least("alphaCutoff", cutoff, 0.0)? }
            }
            Checked::Valid(JsonAlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        if let Some(extensions) = &json.extensions {
            self.json_extensions(extensions, &mut material)?;
        }
        self.more_extensions(&more.extensions, &mut material)?;
        Ok(material)
    }

    fn metallic_roughness(&mut self, json: &json::PbrMetallicRoughness) -> Result<Material, Problem> {
        Ok(Material {
            base_color: self.units("baseColorFactor", json.base_color_factor.0)?,
            base_color_texture: self.info(json.base_color_texture.as_ref(), ColorSpace::Srgb)?,
            metallic: self.unit("metallicFactor", json.metallic_factor.0)?,
            roughness: self.unit("roughnessFactor", json.roughness_factor.0)?,
            metallic_roughness_texture: self
                .info(json.metallic_roughness_texture.as_ref(), ColorSpace::Linear)?,
            ..Material::default()
        })
    }

    /// Reads normal map, occlusion and emission.
    fn maps(
        &mut self,
        json: &json::Material,
        more: &extensions::Material,
        material: &mut Material,
    ) -> Result<(), Problem> {
        if let Some(map) = &json.normal_texture {
            let transform = more.normal_texture.extensions.transform.as_ref();
            material.normal_scale = self.finite("normal scale", map.scale)?;
            let index = map.index.value();
            material.normal_texture = self.texture(index, map.tex_coord, transform, ColorSpace::Linear)?;
        }
        if let Some(map) = &json.occlusion_texture {
            let transform = more.occlusion_texture.extensions.transform.as_ref();
            material.occlusion_strength = self.unit("occlusion strength", map.strength.0)?;
            let index = map.index.value();
            material.occlusion_texture = self.texture(index, map.tex_coord, transform, ColorSpace::Linear)?;
        }
        material.emissive = self.positive("emissiveFactor", json.emissive_factor.0)?;
        material.emissive_texture = self.info(json.emissive_texture.as_ref(), ColorSpace::Srgb)?;
        Ok(())
    }

    /// Reads the extensions that the `gltf` crate has types for.
    fn json_extensions(
        &mut self,
        json: &gltf::json::extensions::material::Material,
        material: &mut Material,
    ) -> Result<(), Problem> {
        material.unlit = json.unlit.is_some();
        if let Some(strength) = &json.emissive_strength {
            let strength = strength.emissive_strength.0;
            material.emissive_strength = self.at_least("emissiveStrength", strength, 0.0)?;
        }
        if let Some(ior) = &json.ior {
            let ior = self.at_least("ior", ior.ior.0, 0.0)?;
            material.ior = if ior == 0.0 { ior } else { self.at_least("ior", ior, 1.0)? };
        }
        if let Some(json) = &json.transmission {
            let factor = self.unit("transmissionFactor", json.transmission_factor.0)?;
            let texture = self.info(json.transmission_texture.as_ref(), ColorSpace::Linear)?;
            material.transmission = Some(Transmission { factor, texture });
        }
        if let Some(json) = &json.volume {
            let distance = json.attenuation_distance.0;
            material.volume = Some(Volume {
                thickness: self.at_least("thicknessFactor", json.thickness_factor.0, 0.0)?,
                thickness_texture: self.info(json.thickness_texture.as_ref(), ColorSpace::Linear)?,
                // A distance of zero or less, or beyond all numbers, does not attenuate.
                attenuation_distance: if distance > 0.0 { distance } else { f32::INFINITY },
                attenuation_color: self.units("attenuationColor", json.attenuation_color.0)?,
            });
        }
        if let Some(json) = &json.specular {
            material.specular = Some(Specular {
                factor: self.unit("specularFactor", json.specular_factor.0)?,
                texture: self.info(json.specular_texture.as_ref(), ColorSpace::Linear)?,
                color: self.positive("specularColorFactor", json.specular_color_factor.0)?,
                color_texture: self.info(json.specular_color_texture.as_ref(), ColorSpace::Srgb)?,
            });
        }
        Ok(())
    }

    /// Reads the other extensions.
    fn more_extensions(
        &mut self,
        json: &extensions::MaterialExtensions,
        material: &mut Material,
    ) -> Result<(), Problem> {
        if let Some(json) = &json.clearcoat {
            material.clearcoat = Some(self.clearcoat(json)?);
        }
        if let Some(json) = &json.sheen {
            material.sheen = Some(Sheen {
                color: self.units("sheenColorFactor", json.sheen_color_factor)?,
                color_texture: self.other(json.sheen_color_texture.as_ref(), ColorSpace::Srgb)?,
                roughness: self.unit("sheenRoughnessFactor", json.sheen_roughness_factor)?,
                roughness_texture: self.other(json.sheen_roughness_texture.as_ref(), ColorSpace::Linear)?,
            });
        }
        if let Some(json) = &json.anisotropy {
            material.anisotropy = Some(Anisotropy {
                strength: self.unit("anisotropyStrength", json.anisotropy_strength)?,
                rotation: self.finite("anisotropyRotation", json.anisotropy_rotation)?,
                texture: self.other(json.anisotropy_texture.as_ref(), ColorSpace::Linear)?,
            });
        }
        if let Some(json) = &json.iridescence {
            material.iridescence = Some(Iridescence {
                factor: self.unit("iridescenceFactor", json.iridescence_factor)?,
                texture: self.other(json.iridescence_texture.as_ref(), ColorSpace::Linear)?,
                ior: self.at_least("iridescenceIor", json.iridescence_ior, 1.0)?,
                thickness_min: self.at_least(
                    "iridescenceThicknessMinimum",
                    json.iridescence_thickness_minimum,
                    0.0,
                )?,
                thickness_max: self.at_least(
                    "iridescenceThicknessMaximum",
                    json.iridescence_thickness_maximum,
                    0.0,
                )?,
                thickness_texture: self
                    .other(json.iridescence_thickness_texture.as_ref(), ColorSpace::Linear)?,
            });
        }
        Ok(())
    }

    fn clearcoat(&mut self, json: &extensions::Clearcoat) -> Result<Clearcoat, Problem> {
        let scale = json.clearcoat_normal_texture.as_ref().map_or(1.0, |map| map.scale);
        Ok(Clearcoat {
            factor: self.unit("clearcoatFactor", json.clearcoat_factor)?,
            texture: self.other(json.clearcoat_texture.as_ref(), ColorSpace::Linear)?,
            roughness: self.unit("clearcoatRoughnessFactor", json.clearcoat_roughness_factor)?,
            roughness_texture: self.other(json.clearcoat_roughness_texture.as_ref(), ColorSpace::Linear)?,
            normal_texture: self.other(json.clearcoat_normal_texture.as_ref(), ColorSpace::Linear)?,
            normal_scale: self.finite("clearcoat normal scale", scale)?,
        })
    }

    fn info(&mut self, info: Option<&Info>, space: ColorSpace) -> Result<Option<TextureRef>, Problem> {
        let Some(info) = info else { return Ok(None) };
        let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
        self.texture(info.index.value(), info.tex_coord, transform, space)
    }

    fn other(
        &mut self,
        info: Option<&TextureInfo>,
        space: ColorSpace,
    ) -> Result<Option<TextureRef>, Problem> {
        let Some(info) = info else { return Ok(None) };
        self.texture(info.index as usize, info.tex_coord, info.extensions.transform.as_ref(), space)
    }

    fn texture(
        &mut self,
        index: usize,
        tex_coord: u32,
        transform: Option<&JsonTransform>,
        space: ColorSpace,
    ) -> Result<Option<TextureRef>, Problem> {
        let Some((image, sampler)) = self.textures.use_texture(index, space, &self.place, self.warnings)?
        else {
            return Ok(None);
        };
        let tex_coord = transform.and_then(|transform| transform.tex_coord).unwrap_or(tex_coord) as usize;
        let transform = transform.map(|json| self.transform(json)).transpose()?;
        Ok(Some(TextureRef { image, sampler, tex_coord, transform }))
    }

    fn transform(&self, json: &JsonTransform) -> Result<TextureTransform, Problem> {
        let [[u, v], [su, sv]] = [json.offset.0, json.scale.0];
        for number in [u, v, su, sv, json.rotation.0] {
            self.finite("KHR_texture_transform", number)?;
        }
        Ok(TextureTransform { offset: [u, v], rotation: json.rotation.0, scale: [su, sv] })
    }

    fn finite(&self, what: &str, number: f32) -> Result<f32, Problem> {
        if number.is_finite() {
            return Ok(number);
        }
        Err(Problem::NotFinite { place: self.place.clone(), what: what.into() })
    }

    fn clamped(&mut self, what: &str, number: f32, least: f32, most: f32) -> Result<f32, Problem> {
        let clamped = self.finite(what, number)?.clamp(least, most);
        if clamped != number {
            let what = format!("{what} {number}, which is out of range");
            self.warnings.push(Warning::Corrected { place: self.place.clone(), what });
        }
        Ok(clamped)
    }

    fn unit(&mut self, what: &str, number: f32) -> Result<f32, Problem> {
        self.clamped(what, number, 0.0, 1.0)
    }

    fn at_least(&mut self, what: &str, number: f32, least: f32) -> Result<f32, Problem> {
        self.clamped(what, number, least, f32::MAX)
    }

    fn units<const N: usize>(&mut self, what: &str, mut numbers: [f32; N]) -> Result<[f32; N], Problem> {
        for number in &mut numbers {
            *number = self.unit(what, *number)?;
        }
        Ok(numbers)
    }

    fn positive(&mut self, what: &str, mut numbers: [f32; 3]) -> Result<[f32; 3], Problem> {
        for number in &mut numbers {
            *number = self.at_least(what, *number, 0.0)?;
        }
        Ok(numbers)
    }
}
