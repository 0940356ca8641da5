//! Triangles that glow, which shadow rays look for.

use std::collections::HashMap;

use glam::{DVec3, Mat3, Vec3};
use lvk_gltf::{AlphaMode, ColorSpace, Image, Material, Model, Primitive, TexelFormat};

use super::layout::{GpuEmitter, GpuInstance};
use crate::light::luminance;

/// Most triangles that shadow rays look for. Beyond it paths alone find light of triangles.
const MOST_EMITTERS: usize = 1 << 18;
/// Texels of an image that its mean is taken of.
const MEAN_TEXELS: usize = 4096;
/// The mean of images whose texels are compressed.
const UNKNOWN_MEAN: f64 = 0.25;

/// Triangles that glow in the space of their mesh.
#[derive(Debug, Clone)]
struct Part {
    /// The geometry of the mesh.
    geometry: u32,
    /// Luminance of its emission, so far as it is known without looking at each texel.
    weight: f32,
    /// The colour of its emission, whose luminance is 1.
    color: DVec3,
    /// Two edges of each triangle.
    edges: Vec<[Vec3; 2]>,
}

/// Triangles that glow, of meshes whose vertices stand still.
#[derive(Debug, Clone, Default)]
pub(crate) struct EmissiveMeshes {
    /// By the first geometry of the mesh.
    meshes: HashMap<u32, Vec<Part>>,
}

/// The triangles of a scene that glow.
#[derive(Debug, Clone, Default)]
pub(crate) struct Emitters {
    pub(crate) triangles: Vec<GpuEmitter>,
    /// Sum of areas times weights.
    pub(crate) power: f64,
    /// The same in colours: sum of areas times radiances.
    pub(crate) light: DVec3,
}

impl EmissiveMeshes {
    /// Adds a primitive that is the geometry with the number `geometry` of the mesh whose first one has the number `first`.
    pub(crate) fn add(
        &mut self,
        (first, geometry): (u32, u32),
        primitive: &Primitive,
        (weight, color): (f32, DVec3),
    ) {
        let at = |index: u32| Vec3::from(primitive.positions.get(index as usize).unwrap_or_default());
        let edges = |corners: &[u32]| {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(at);
            [b - a, c - a]
        };
        let edges = primitive.indices.chunks_exact(3).map(edges).collect();
        self.meshes.entry(first).or_default().push(Part { geometry, weight, color, edges });
    }

    /// True if nothing glows.
    pub(crate) fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// The triangles of these instances, each chosen by its area and its weight.
    pub(crate) fn emitters(&self, instances: &[GpuInstance]) -> Emitters {
        let (mut all, mut light) = (Vec::new(), DVec3::ZERO);
        for (instance, placed) in (0..).zip(instances) {
            let matrix = Mat3::from_cols_array_2d(
                &[0, 1, 2].map(|column| [0, 4, 8].map(|row| placed.rows[row + column])),
            );
            for part in self.meshes.get(&placed.first_geometry).into_iter().flatten() {
                for (primitive, [u, v]) in (0..).zip(&part.edges) {
                    let area = 0.5 * (matrix * *u).as_dvec3().cross((matrix * *v).as_dvec3()).length();
                    let share = area * f64::from(part.weight);
                    if share > 0.0 && share.is_finite() {
                        light += share * part.color;
                        all.push((
                            GpuEmitter { instance, geometry: part.geometry, primitive, chance: 0.0 },
                            share,
                        ));
                    }
                }
                if all.len() > MOST_EMITTERS {
                    return Emitters::default();
                }
            }
        }
        let power = all.iter().map(|(_, share)| share).sum::<f64>();
        let mut sum = 0.0;
        let triangles = all.into_iter().map(|(emitter, share)| {
            sum += share;
            GpuEmitter { chance: (sum / power) as f32, ..emitter }
        });
        Emitters { triangles: triangles.collect(), power, light }
    }
}

/// The luminance of what a material emits, in the mean over its texture; 0 if shadow rays do not look for it.
pub(crate) fn emission_weight(material: &Material, model: &Model) -> f32 {
    let is_solid = material.alpha_mode == AlphaMode::Opaque && !material.unlit;
    let texture = material.emissive_texture.and_then(|texture| model.images.get(texture.image));
    let emission = Vec3::from(material.emissive).as_dvec3() * f64::from(material.emissive_strength);
    // Dark textures may have bright texels.
    let mean = texture.map_or(1.0, |image| mean_luminance(image).max(1e-3));
    let weight = luminance(emission) * mean;
    if is_solid && weight.is_finite() { weight.max(0.0) as f32 } else { 0.0 }
}

/// The colour of what a material emits, with a luminance of 1. That of its texture is left out.
pub(crate) fn emission_color(material: &Material) -> DVec3 {
    let emission = Vec3::from(material.emissive).as_dvec3();
    let bright = luminance(emission);
    if bright > 0.0 { emission / bright } else { DVec3::ONE }
}

fn mean_luminance(image: &Image) -> f64 {
    let Some(level) = image.data.mips.first().filter(|_| image.data.format == TexelFormat::Rgba8) else {
        return UNKNOWN_MEAN;
    };
    let step = (level.bytes.len() / 4).div_ceil(MEAN_TEXELS).max(1);
    let linear = |byte: u8| {
        let share = f64::from(byte) / 255.0;
        match image.color_space {
            ColorSpace::Srgb => {
                if share <= 0.04045 {
                    share / 12.92
                } else {
                    ((share + 0.055) / 1.055).powf(2.4)
                }
            }
            ColorSpace::Linear => share,
        }
    };
    let texels = level.bytes.chunks_exact(4).step_by(step);
    let (count, sum) = texels.fold((0_u32, 0.0), |(count, sum), texel| {
        let color = DVec3::new(linear(texel[0]), linear(texel[1]), linear(texel[2]));
        (count + 1, sum + luminance(color))
    });
    if count > 0 { sum / f64::from(count) } else { UNKNOWN_MEAN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lvk_gltf::Positions;

    fn triangle(size: f32) -> Primitive {
        Primitive {
            positions: Positions::F32(vec![[0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]]),
            indices: vec![0, 1, 2],
            ..Primitive::default()
        }
    }

    #[test]
    fn triangles_are_chosen_by_area_in_the_world_and_luminance() {
        let mut meshes = EmissiveMeshes::default();
        let (red, white) = (DVec3::new(4.0, 0.0, 0.0), DVec3::ONE);
        meshes.add((4, 0), &triangle(1.0), (3.0, red));
        meshes.add((4, 2), &triangle(2.0), (1.0, white));
        let instance = |first_geometry, scale: f32| GpuInstance {
            rows: [scale, 0.0, 0.0, 9.0, 0.0, scale, 0.0, 9.0, 0.0, 0.0, scale, 9.0],
            normal_columns: [0.0; 9],
            first_geometry,
        };
        let emitters = meshes.emitters(&[instance(4, 1.0), instance(0, 1.0), instance(4, 2.0)]);
        // Areas of 0.5 and 2 weigh 1.5 and 2; in the larger instance four times as much.
        assert!((emitters.power - 17.5).abs() < 1e-6);
        assert!(emitters.light.abs_diff_eq(7.5 * red + 10.0 * white, 1e-6), "{}", emitters.light);
        let found: Vec<_> =
            emitters.triangles.iter().map(|one| (one.instance, one.geometry, one.chance * 17.5)).collect();
        assert_eq!(found, [(0, 0, 1.5), (0, 2, 3.5), (2, 0, 9.5), (2, 2, 17.5)]);
        assert!(meshes.emitters(&[instance(4, 0.0)]).triangles.is_empty());
    }

    #[test]
    fn materials_with_holes_and_without_light_are_left_out() {
        let model = Model::default();
        let glowing = Material { emissive: [1.0, 0.0, 0.0], emissive_strength: 10.0, ..Material::default() };
        assert!((emission_weight(&glowing, &model) - 2.126).abs() < 1e-3);
        assert!(
            (luminance(emission_color(&glowing)) - 1.0).abs() < 1e-9 && emission_color(&glowing).y == 0.0
        );
        assert_eq!(emission_weight(&Material::default(), &model), 0.0);
        assert_eq!(emission_color(&Material::default()), DVec3::ONE);
        let holes = Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..glowing };
        assert_eq!(emission_weight(&holes, &model), 0.0);
    }
}
