//! Light from outside of the model: the sky, and the sun in it.

mod atmosphere;
mod hdr_file;
mod radiance_picture;
mod sky_map;

use std::path::Path;

use glam::DVec3;

use atmosphere::Atmosphere;
pub use hdr_file::EnvironmentError;
pub use radiance_picture::RadianceError;
pub use sky_map::SkyMap;
pub(crate) use sky_map::luminance;

/// Texels in a row and in a column of the map of the sky.
const MAP_SIZE: [u32; 2] = [256, 128];
/// Share of light that the ground reflects, which the map shows below the horizon.
const GROUND: DVec3 = DVec3::new(0.20, 0.19, 0.17);

/// A sun: a disc that is infinitely far away.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Unit vector towards it.
    pub direction: [f32; 3],
    /// Irradiance of a surface that faces it, linear.
    pub irradiance: [f32; 3],
    /// Radius of the disc as an angle, in radians, above 0.
    pub radius: f32,
}

/// Light that comes from outside of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// The sky without the sun.
    pub sky: SkyMap,
    /// The sun.
    pub sun: Option<Sun>,
}

/// Place and size of the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunSetting {
    /// Angle above the horizon in degrees, 1 to 90.
    pub elevation_degrees: f32,
    /// Angle around the vertical in degrees, from +z towards +x.
    pub azimuth_degrees: f32,
    /// Radius of the disc in degrees, above 0. That of the real sun is 0.27.
    pub radius_degrees: f32,
}

impl Default for SunSetting {
    fn default() -> Self {
        Self { elevation_degrees: 42.0, azimuth_degrees: -58.0, radius_degrees: 0.5 }
    }
}

impl Environment {
    /// A clear day. Under it, matte white ground has the luminance 1.
    #[must_use]
    pub fn day(setting: &SunSetting) -> Self {
        let (sine, cosine) = f64::from(setting.elevation_degrees).to_radians().sin_cos();
        let (east, south) = f64::from(setting.azimuth_degrees).to_radians().sin_cos();
        let to_sun = DVec3::new(cosine * east, sine, cosine * south);
        let air = Atmosphere::new(to_sun);
        let sun = air.sun_transmittance();
        let [width, height] = MAP_SIZE;
        let open = SkyMap::clear(&air, DVec3::ZERO, width, height);
        let white = (sun * sine.max(0.0) + open.irradiance()) / std::f64::consts::PI;
        let scale = 1.0 / luminance(white).max(1e-9);
        let sky = SkyMap::clear(&air, GROUND * white, width, height).scaled(scale as f32);
        let irradiance = (sun * scale).as_vec3().to_array();
        let radius = setting.radius_degrees.to_radians();
        Self { sky, sun: Some(Sun { direction: to_sun.as_vec3().to_array(), irradiance, radius }) }
    }

    /// The light of a Radiance HDR file, whose picture shows all directions (equirectangular). The sun is part of the picture.
    /// `rotation_degrees` turns it around the vertical, counter-clockwise from above.
    ///
    /// # Errors
    /// [`EnvironmentError`], which names the file and what is wrong with it.
    pub fn from_hdr(path: &Path, rotation_degrees: f32) -> Result<Self, EnvironmentError> {
        Ok(Self { sky: hdr_file::read(path, rotation_degrees)?, sun: None })
    }

    /// The same radiance from everywhere, without a sun.
    #[must_use]
    pub fn uniform(radiance: [f32; 3]) -> Self {
        Self { sky: SkyMap::uniform(radiance), sun: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_ground_has_the_luminance_one_by_day() {
        for elevation_degrees in [8.0, 38.0, 85.0] {
            let setting = SunSetting { elevation_degrees, ..SunSetting::default() };
            let day = Environment::day(&setting);
            let sun = day.sun.unwrap();
            let direct = DVec3::from(sun.irradiance.map(f64::from)) * f64::from(sun.direction[1]);
            let white = luminance(direct + day.sky.irradiance()) / std::f64::consts::PI;
            assert!((white - 1.0).abs() < 0.02, "{elevation_degrees} degrees: {white}");
        }
    }
}
