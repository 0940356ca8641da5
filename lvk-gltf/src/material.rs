//! Materials: the metallic-roughness model and its extensions.

/// A material. Factors multiply texels of their texture; without a texture they stand alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: Option<String>,
    /// Linear base colour and alpha, from 0 to 1.
    pub base_color: [f32; 4],
    /// Base colour, sRGB, and alpha.
    pub base_color_texture: Option<TextureRef>,
    /// Metalness, from 0 (a dielectric) to 1 (a metal).
    pub metallic: f32,
    /// Roughness, from 0 (a mirror) to 1. It is the square root of the alpha of the GGX distribution.
    pub roughness: f32,
    /// Roughness in green, metalness in blue.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Normals in tangent space: `2 * texel - 1`, of which x and y are multiplied by `normal_scale`.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map.
    pub normal_scale: f32,
    /// Ambient occlusion in red.
    pub occlusion_texture: Option<TextureRef>,
    /// Strength of the occlusion, from 0 to 1: `1 + strength * (texel - 1)`.
    pub occlusion_strength: f32,
    /// Linear emitted colour. With `emissive_strength` the radiance, in candela a square metre.
    pub emissive: [f32; 3],
    /// Multiplies the emitted colour (`KHR_materials_emissive_strength`).
    pub emissive_strength: f32,
    /// Emitted colour, sRGB.
    pub emissive_texture: Option<TextureRef>,
    /// How alpha is used.
    pub alpha_mode: AlphaMode,
    /// Whether back faces are seen. Their normals are turned.
    pub double_sided: bool,
    /// Whether the base colour is shown as it is, without light (`KHR_materials_unlit`).
    pub unlit: bool,
    /// Index of refraction, 1 or more, or 0 for a dielectric that reflects everything (`KHR_materials_ior`). 1.5 without the extension.
    pub ior: f32,
    /// Light passes through the surface (`KHR_materials_transmission`).
    pub transmission: Option<Transmission>,
    /// The inside of the mesh is a medium (`KHR_materials_volume`).
    pub volume: Option<Volume>,
    /// A clear coat (`KHR_materials_clearcoat`).
    pub clearcoat: Option<Clearcoat>,
    /// Sheen of cloth (`KHR_materials_sheen`).
    pub sheen: Option<Sheen>,
    /// Strength and colour of the dielectric reflection (`KHR_materials_specular`).
    pub specular: Option<Specular>,
    /// Reflections that are stretched in one direction (`KHR_materials_anisotropy`).
    pub anisotropy: Option<Anisotropy>,
    /// A thin film (`KHR_materials_iridescence`).
    pub iridescence: Option<Iridescence>,
}

/// How alpha is used.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// What has less alpha than the cutoff is not there.
    Mask {
        /// The smallest alpha that is seen.
        cutoff: f32,
    },
    /// Alpha is the coverage of what lies behind.
    Blend,
}

/// A texture of a material: an image, and how it is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// The image, as an index into [`Model::images`](crate::Model::images). Its colour space is that of this use.
    pub image: usize,
    /// The sampler, as an index into [`Model::samplers`](crate::Model::samplers).
    pub sampler: usize,
    /// The set of texture coordinates.
    pub tex_coord: usize,
    /// Transform of the texture coordinates (`KHR_texture_transform`). The set that it may name is in `tex_coord`.
    pub transform: Option<TextureTransform>,
}

/// A transform of texture coordinates: first the scale, then the rotation, then the offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureTransform {
    /// Offset, in sizes of the image.
    pub offset: [f32; 2],
    /// Rotation, radians: turns the image clockwise as the viewer sees it.
    pub rotation: f32,
    /// Scale of the coordinates.
    pub scale: [f32; 2],
}

/// `KHR_materials_transmission`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transmission {
    /// Part of the light that passes, from 0 to 1.
    pub factor: f32,
    /// Multiplies the factor by red.
    pub texture: Option<TextureRef>,
}

/// `KHR_materials_volume`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// Thickness beneath the surface in the space of the mesh; 0 is a thin wall. Ray tracers measure it themselves.
    pub thickness: f32,
    /// Multiplies the thickness by green.
    pub thickness_texture: Option<TextureRef>,
    /// Distance, metres, after which white light has the attenuation colour. May be infinite.
    pub attenuation_distance: f32,
    /// Linear colour of white light after the attenuation distance.
    pub attenuation_color: [f32; 3],
}

/// `KHR_materials_clearcoat`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearcoat {
    /// Strength of the coat, from 0 to 1.
    pub factor: f32,
    /// Multiplies the strength by red.
    pub texture: Option<TextureRef>,
    /// Roughness of the coat, from 0 to 1.
    pub roughness: f32,
    /// Multiplies the roughness by green.
    pub roughness_texture: Option<TextureRef>,
    /// Normals of the coat. Without it the coat has the normals of the mesh.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the coat's normal map.
    pub normal_scale: f32,
}

/// `KHR_materials_sheen`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheen {
    /// Linear colour of the sheen.
    pub color: [f32; 3],
    /// Multiplies the colour, sRGB.
    pub color_texture: Option<TextureRef>,
    /// Roughness of the sheen, from 0 to 1.
    pub roughness: f32,
    /// Multiplies the roughness by alpha.
    pub roughness_texture: Option<TextureRef>,
}

/// `KHR_materials_specular`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Specular {
    /// Strength of the dielectric reflection, from 0 to 1.
    pub factor: f32,
    /// Multiplies the strength by alpha.
    pub texture: Option<TextureRef>,
    /// Linear colour of the reflection at normal incidence. May be more than 1.
    pub color: [f32; 3],
    /// Multiplies the colour, sRGB.
    pub color_texture: Option<TextureRef>,
}

/// `KHR_materials_anisotropy`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anisotropy {
    /// Strength, from 0 to 1.
    pub strength: f32,
    /// Angle of the direction, radians, counter-clockwise from the tangent.
    pub rotation: f32,
    /// Direction in red and green, as `2 * texel - 1`; multiplies the strength by blue.
    pub texture: Option<TextureRef>,
}

/// `KHR_materials_iridescence`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iridescence {
    /// Strength, from 0 to 1.
    pub factor: f32,
    /// Multiplies the strength by red.
    pub texture: Option<TextureRef>,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Thickness of the film, nanometres, where the texture is 0.
    pub thickness_min: f32,
    /// Thickness of the film, nanometres, where the texture is 1, and without a texture.
    pub thickness_max: f32,
    /// Chooses between the two thicknesses by green.
    pub thickness_texture: Option<TextureRef>,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: None,
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: [0.0; 3],
            emissive_strength: 1.0,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            transmission: None,
            volume: None,
            clearcoat: None,
            sheen: None,
            specular: None,
            anisotropy: None,
            iridescence: None,
        }
    }
}

impl TextureTransform {
    /// Returns the transformed coordinates.
    #[must_use]
    pub fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        let (sin, cos) = self.rotation.sin_cos();
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        [self.offset[0] + cos * u + sin * v, self.offset[1] - sin * u + cos * v]
    }
}

impl Material {
    /// Returns the textures that the material has, each with its name in the file.
    pub fn textures(&self) -> impl Iterator<Item = (&'static str, &TextureRef)> {
        let (clearcoat, sheen) = (self.clearcoat.as_ref(), self.sheen.as_ref());
        let (specular, iridescence) = (self.specular.as_ref(), self.iridescence.as_ref());
        let volume = self.volume.as_ref();
        let all = [
            ("baseColorTexture", self.base_color_texture.as_ref()),
            ("metallicRoughnessTexture", self.metallic_roughness_texture.as_ref()),
            ("normalTexture", self.normal_texture.as_ref()),
            ("occlusionTexture", self.occlusion_texture.as_ref()),
            ("emissiveTexture", self.emissive_texture.as_ref()),
            ("transmissionTexture", self.transmission.as_ref().and_then(|it| it.texture.as_ref())),
            ("thicknessTexture", volume.and_then(|it| it.thickness_texture.as_ref())),
            ("clearcoatTexture", clearcoat.and_then(|it| it.texture.as_ref())),
            ("clearcoatRoughnessTexture", clearcoat.and_then(|it| it.roughness_texture.as_ref())),
            ("clearcoatNormalTexture", clearcoat.and_then(|it| it.normal_texture.as_ref())),
            ("sheenColorTexture", sheen.and_then(|it| it.color_texture.as_ref())),
            ("sheenRoughnessTexture", sheen.and_then(|it| it.roughness_texture.as_ref())),
            ("specularTexture", specular.and_then(|it| it.texture.as_ref())),
            ("specularColorTexture", specular.and_then(|it| it.color_texture.as_ref())),
            ("anisotropyTexture", self.anisotropy.as_ref().and_then(|it| it.texture.as_ref())),
            ("iridescenceTexture", iridescence.and_then(|it| it.texture.as_ref())),
            ("iridescenceThicknessTexture", iridescence.and_then(|it| it.thickness_texture.as_ref())),
        ];
        all.into_iter().filter_map(|(name, texture)| texture.map(|texture| (name, texture)))
    }

    /// Returns the set of texture coordinates along which tangents lie: that of the normal map, else of the clear coat's,
    /// else that of the anisotropy. `None` if the material needs no tangents.
    #[must_use]
    pub fn tangent_tex_coord(&self) -> Option<usize> {
        let clearcoat = self.clearcoat.as_ref().and_then(|clearcoat| clearcoat.normal_texture.as_ref());
        let map = self.normal_texture.as_ref().or(clearcoat).map(|texture| texture.tex_coord);
        let anisotropy = |it: &Anisotropy| it.texture.as_ref().map_or(0, |texture| texture.tex_coord);
        map.or_else(|| self.anisotropy.as_ref().map(anisotropy))
    }
}
