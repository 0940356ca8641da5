//! The material of a surface.

/// The material of a surface; the formulas are in the documentation of the module.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Diffuse reflectance, linear RGB, 0 to 1; multiplies the texture if there is one.
    pub albedo: [f32; 3],
    /// Index into [`super::Scene::textures`].
    pub albedo_texture: Option<u32>,
    /// True if its texture has holes where alpha is below one half. Only rasterisers heed it.
    pub is_masked: bool,
    /// Index into [`super::Scene::normal_maps`]. Only the `sponza` sample heeds it.
    pub normal_map: Option<u32>,
    /// Colour of the highlight, linear RGB, 0 to 1.
    pub specular: [f32; 3],
    /// Phong exponent of the highlight, 1 to 10,000.
    pub shininess: f32,
    /// Share of mirror reflection, 0 to 1.
    pub reflectivity: f32,
    /// Share of light that passes, 0 to 1; above 0 the surface is refractive and casts no shadow.
    pub transmission: f32,
    /// Colour of mirrored and refracted light, linear RGB, 0 to 1; white changes nothing.
    pub tint: [f32; 3],
    /// Index of refraction behind the surface, at least 1; used where `transmission` is above 0.
    pub ior: f32,
    /// Radiance the surface sends out by itself, linear RGB.
    pub emission: [f32; 3],
}

impl Material {
    /// A surface without highlight, mirror or glass.
    pub fn matte(name: &str, albedo: [f32; 3]) -> Self {
        Self {
            name: name.to_owned(),
            albedo,
            albedo_texture: None,
            is_masked: false,
            normal_map: None,
            specular: [0.0; 3],
            shininess: 1.0,
            reflectivity: 0.0,
            transmission: 0.0,
            tint: [1.0; 3],
            ior: 1.5,
            emission: [0.0; 3],
        }
    }

    /// A polished metal: a mirror with a colour.
    pub fn metal(name: &str, tint: [f32; 3], reflectivity: f32) -> Self {
        let base = tint.map(|c| 0.5 * c);
        Self { specular: tint, shininess: 400.0, reflectivity, tint, ..Self::matte(name, base) }
    }

    /// Clear glass with index of refraction `ior`.
    pub fn glass(name: &str, tint: [f32; 3], ior: f32) -> Self {
        let highlight = [1.0; 3];
        Self {
            specular: highlight,
            shininess: 2000.0,
            transmission: 0.95,
            tint,
            ior,
            ..Self::matte(name, [0.0; 3])
        }
    }

    /// The glaring orange that stands in for a material that the file does not define.
    pub(super) fn stand_in(name: &str) -> Self {
        Self { emission: [0.12, 0.03, 0.0], ..Self::matte(name, [1.0, 0.25, 0.0]) }
    }

    /// True if rays go on behind the surface.
    pub fn is_refractive(&self) -> bool {
        self.transmission > 0.0
    }
}
