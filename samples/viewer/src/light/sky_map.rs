//! The sky as a map of all directions, and the distribution that shaders draw directions from.

use glam::{DVec3, Vec3};

use super::atmosphere::Atmosphere;

/// Share of the distribution that is the same for all directions: none of them is left out, however dark it is in the map.
const UNIFORM_SHARE: f64 = 0.02;

/// Radiance from all directions. The columns of the map go around y, its rows from the zenith to the nadir; texels cover the same
/// angle.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyMap {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, linear.
    pub texels: Vec<[f32; 3]>,
}

/// A cumulative distribution of the brightness of a [`SkyMap`] over solid angle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SkyDistribution {
    /// The distribution of rows.
    pub(crate) rows: Vec<f32>,
    /// The distribution of the texels of each row, one row after another.
    pub(crate) columns: Vec<f32>,
}

impl SkyMap {
    /// The same radiance from everywhere.
    #[must_use]
    pub fn uniform(radiance: [f32; 3]) -> Self {
        Self { width: 2, height: 2, texels: vec![radiance; 4] }
    }

    /// A clear sky above ground of this radiance, for a sun of irradiance 1 outside of the air.
    pub(super) fn clear(air: &Atmosphere, ground: DVec3, width: u32, height: u32) -> Self {
        let texel = |index: u32| {
            let direction = direction_at(index % width, index / width, width, height).as_dvec3();
            let above = DVec3::new(direction.x, direction.y.max(0.002), direction.z).normalize();
            let sky = air.radiance(above);
            let below = (-direction.y * 12.0).clamp(0.0, 1.0);
            sky.lerp(ground, below).as_vec3().to_array()
        };
        Self { width, height, texels: (0..width * height).map(texel).collect() }
    }

    /// Irradiance of a surface that faces the zenith.
    pub(super) fn irradiance(&self) -> DVec3 {
        self.integral(|direction| f64::from(direction.y.max(0.0)))
    }

    /// Mean radiance over all directions.
    pub(crate) fn mean(&self) -> DVec3 {
        self.integral(|_| 1.0) / (4.0 * std::f64::consts::PI)
    }

    fn integral(&self, weight: impl Fn(Vec3) -> f64) -> DVec3 {
        let (width, height) = (self.width, self.height);
        let texels = (0..).zip(&self.texels);
        texels
            .map(|(index, texel)| {
                let (column, row) = (index % width, index / width);
                let radiance = Vec3::from(*texel).as_dvec3();
                radiance * weight(direction_at(column, row, width, height)) * solid_angle(row, width, height)
            })
            .sum()
    }

    /// The same, brighter by a factor.
    pub(super) fn scaled(mut self, factor: f32) -> Self {
        self.texels.iter_mut().flatten().for_each(|channel| *channel *= factor);
        self
    }

    /// The distribution of its brightness.
    pub(crate) fn distribution(&self) -> SkyDistribution {
        let (width, height) = (self.width, self.height);
        let mean = luminance(self.mean());
        let weight = |index: usize| {
            let row = index as u32 / width;
            let bright = luminance(Vec3::from(self.texels[index]).as_dvec3());
            ((1.0 - UNIFORM_SHARE) * bright + UNIFORM_SHARE * mean).max(1e-12)
                * solid_angle(row, width, height)
        };
        let weights: Vec<f64> = (0..self.texels.len()).map(weight).collect();
        let rows: Vec<f64> = weights.chunks(width as usize).map(|row| row.iter().sum()).collect();
        let columns = weights.chunks(width as usize).flat_map(cumulative).collect();
        SkyDistribution { rows: cumulative(&rows), columns }
    }
}

/// Brightness of a colour to the eye.
pub(crate) fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

fn cumulative(weights: &[f64]) -> Vec<f32> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let mut all: Vec<f32> = weights
        .iter()
        .map(|weight| {
            sum += weight;
            (sum / total) as f32
        })
        .collect();
    if let Some(last) = all.last_mut() {
        *last = 1.0;
    }
    all
}

/// The middle of a texel; `skyPlace` in `shaders/viewer/sky.glsl` is the reverse.
fn direction_at(column: u32, row: u32, width: u32, height: u32) -> Vec3 {
    let around = std::f32::consts::TAU * ((column as f32 + 0.5) / width as f32 - 0.5);
    let down = std::f32::consts::PI * (row as f32 + 0.5) / height as f32;
    Vec3::new(down.sin() * around.cos(), down.cos(), down.sin() * around.sin())
}

fn solid_angle(row: u32, width: u32, height: u32) -> f64 {
    let edge = |row: u32| (std::f64::consts::PI * f64::from(row) / f64::from(height)).cos();
    std::f64::consts::TAU / f64::from(width) * (edge(row) - edge(row + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_sky_gives_its_radiance_times_pi() {
        let sky = SkyMap { width: 64, height: 32, texels: vec![[2.0, 1.0, 0.5]; 64 * 32] };
        let relative = sky.irradiance() / (std::f64::consts::PI * DVec3::new(2.0, 1.0, 0.5));
        assert!((relative - 1.0).abs().max_element() < 2e-3, "{relative}");
        assert!((sky.mean() - DVec3::new(2.0, 1.0, 0.5)).abs().max_element() < 1e-6);
    }

    #[test]
    fn a_bright_texel_is_drawn_as_often_as_its_light_says() {
        let mut sky = SkyMap { width: 8, height: 4, texels: vec![[0.0; 3]; 32] };
        sky.texels[8 + 3] = [5.0; 3];
        let all = sky.distribution();
        let share = (all.rows[1] - all.rows[0]) * (all.columns[8 + 3] - all.columns[8 + 2]);
        assert!((0.97..1.0).contains(&share), "{share}");
        assert!(all.rows.is_sorted() && all.rows.last() == Some(&1.0));
        assert!(all.columns.chunks(8).all(|row| row.is_sorted() && row.last() == Some(&1.0)));
    }
}
