//! The model that needs no file: balls of many materials around a knot that can turn, on a tiled floor.

use std::f32::consts::{PI, TAU};

use glam::{Quat, Vec3};
use lvk_gltf::{
    AlphaMode, Animation, Channel, ChannelPath, Clearcoat, Interpolation, Keyframes, Material, Mesh, Model,
    Node, Positions, Primitive, Sampler, Sheen, TextureRef, TextureTransform, Transmission, Trs, Volume,
};
use lvk_samples::shapes;

use super::showcase_textures;

/// Segments around a ball.
const BALL_SEGMENTS: u16 = 96;
/// Units of length that one repetition of the floor's textures covers.
const TILE: f32 = 2.0;
/// Seconds in which the knot turns around once.
const TURN: f32 = 8.0;

/// Builds the model. The same on every machine and every call.
#[must_use]
pub fn showcase() -> Model {
    let mut builder = Builder::default();
    builder.model.images = showcase_textures::images();
    builder.model.samplers = vec![Sampler::default()];
    floor(&mut builder);
    metals(&mut builder);
    plastics(&mut builder);
    specialities(&mut builder);
    knot(&mut builder);
    builder.camera();
    let mut model = builder.model;
    let roots = (0..model.nodes.len()).collect();
    model.scenes = vec![lvk_gltf::Scene { name: Some("showcase".into()), roots }];
    model.default_scene = Some(0);
    model
}

#[derive(Default)]
struct Builder {
    model: Model,
}

impl Builder {
    fn material(&mut self, name: &str, material: Material) -> usize {
        self.model.materials.push(Material { name: Some(name.into()), ..material });
        self.model.materials.len() - 1
    }

    fn mesh(&mut self, name: &str, shape: &shapes::Mesh, material: usize) -> usize {
        let primitives = vec![primitive(shape, material)];
        self.model.meshes.push(Mesh { name: Some(name.into()), primitives, weights: Vec::new() });
        self.model.meshes.len() - 1
    }

    fn place(&mut self, mesh: usize, translation: Vec3, rotation: Quat) {
        let transform = lvk_gltf::Transform::Trs(Trs { translation, rotation, scale: Vec3::ONE });
        self.model.nodes.push(Node { mesh: Some(mesh), transform, ..Node::default() });
    }

    /// A ball that lies on the floor.
    fn ball(&mut self, name: &str, material: Material, [x, z]: [f32; 2], radius: f32) {
        let material = self.material(name, material);
        let shape = shapes::Mesh::default().ball(Vec3::ZERO, Vec3::splat(radius), BALL_SEGMENTS);
        let mesh = self.mesh(name, &shape, material);
        self.place(mesh, Vec3::new(x, radius, z), Quat::IDENTITY);
    }

    fn camera(&mut self) {
        let projection =
            lvk_gltf::Projection::Perspective { yfov: 0.56, aspect_ratio: None, znear: 0.1, zfar: None };
        self.model.cameras.push(lvk_gltf::Camera { name: Some("showcase".into()), projection });
        let (eye, target) = (Vec3::new(0.0, 4.3, 11.6), Vec3::new(0.0, 0.95, 0.0));
        let down = (eye.y - target.y).atan2(eye.z - target.z);
        let transform = lvk_gltf::Transform::Trs(Trs {
            translation: eye,
            rotation: Quat::from_rotation_x(-down),
            scale: Vec3::ONE,
        });
        self.model.nodes.push(Node { camera: Some(0), transform, ..Node::default() });
    }
}

fn primitive(shape: &shapes::Mesh, material: usize) -> Primitive {
    let vertices = &shape.vertices;
    Primitive {
        positions: Positions::F32(vertices.iter().map(|vertex| vertex.position.to_array()).collect()),
        normals: vertices.iter().map(|vertex| vertex.normal.to_array()).collect(),
        tangents: vertices.iter().map(|vertex| tangent(vertex.normal)).collect(),
        tex_coords: vec![vertices.iter().map(|vertex| vertex.texcoord.to_array()).collect()],
        indices: shape.triangles.iter().flatten().map(|index| u32::from(*index)).collect(),
        material: Some(material),
        ..Primitive::default()
    }
}

/// A tangent across the vertical, along which `u` grows.
fn tangent(normal: Vec3) -> [f32; 4] {
    let tangent = Vec3::Y.cross(normal).try_normalize().unwrap_or(Vec3::X);
    [tangent.x, tangent.y, tangent.z, 1.0]
}

fn color([red, green, blue]: [f32; 3], metallic: f32, roughness: f32) -> Material {
    Material { base_color: [red, green, blue, 1.0], metallic, roughness, ..Material::default() }
}

fn floor(builder: &mut Builder) {
    let texture = |image| {
        let transform = Some(TextureTransform { offset: [0.0; 2], rotation: 0.0, scale: [1.0 / TILE; 2] });
        Some(TextureRef { image, sampler: 0, tex_coord: 0, transform })
    };
    let material = Material {
        base_color_texture: texture(showcase_textures::FLOOR_COLOR),
        metallic_roughness_texture: texture(showcase_textures::FLOOR_ROUGHNESS),
        normal_texture: texture(showcase_textures::FLOOR_NORMALS),
        metallic: 0.0,
        ..Material::default()
    };
    let material = builder.material("floor", material);
    let side = 60.0;
    let shape = shapes::Mesh::default().quad(
        Vec3::new(-side, 0.0, -side),
        Vec3::Z * 2.0 * side,
        Vec3::X * 2.0 * side,
        1.0,
    );
    let mesh = builder.mesh("floor", &shape, material);
    builder.place(mesh, Vec3::ZERO, Quat::IDENTITY);
}

/// A row of gold, from polished to rough.
fn metals(builder: &mut Builder) {
    for step in 0..5_u8 {
        let part = f32::from(step) / 4.0;
        let gold = color([1.0, 0.71, 0.29], 1.0, 0.05 + 0.6 * part);
        builder.ball(&format!("gold {step}"), gold, [-3.0 + 1.5 * f32::from(step), 3.3], 0.55);
    }
}

/// Dielectrics beside the knot.
fn plastics(builder: &mut Builder) {
    let blue = color([0.03, 0.12, 0.45], 0.0, 0.12);
    builder.ball("blue plastic", blue, [-4.6, 1.4], 0.75);
    let white = color([0.82, 0.80, 0.76], 0.0, 0.9);
    builder.ball("plaster", white, [4.6, 1.4], 0.75);
    let steel = color([0.56, 0.57, 0.58], 1.0, 0.25);
    builder.ball("steel", steel, [3.7, -2.6], 1.0);
}

/// Glass, a clear coat, cloth, a lamp and a veil.
fn specialities(builder: &mut Builder) {
    let glass = |attenuation_color, attenuation_distance| Material {
        ior: 1.5,
        transmission: Some(Transmission { factor: 1.0, texture: None }),
        volume: Some(Volume {
            thickness: 1.0,
            thickness_texture: None,
            attenuation_distance,
            attenuation_color,
        }),
        ..color([1.0; 3], 0.0, 0.0)
    };
    builder.ball("glass", glass([1.0; 3], f32::INFINITY), [-2.4, 1.2], 0.9);
    builder.ball("amber", glass([0.95, 0.45, 0.08], 0.7), [2.5, 1.1], 0.8);
    let coat = Clearcoat {
        factor: 1.0,
        texture: None,
        roughness: 0.03,
        roughness_texture: None,
        normal_texture: None,
        normal_scale: 1.0,
    };
    let paint = Material { clearcoat: Some(coat), ..color([0.55, 0.02, 0.02], 0.6, 0.45) };
    builder.ball("car paint", paint, [-3.8, -2.4], 1.1);
    let sheen =
        Sheen { color: [0.55, 0.45, 0.75], color_texture: None, roughness: 0.35, roughness_texture: None };
    let velvet = Material { sheen: Some(sheen), ..color([0.10, 0.03, 0.16], 0.0, 0.9) };
    builder.ball("velvet", velvet, [6.3, -1.6], 1.0);
    let lamp = Material { emissive: [1.0, 0.55, 0.18], emissive_strength: 6.0, ..color([0.1; 3], 0.0, 0.5) };
    builder.ball("lamp", lamp, [0.0, 1.9], 0.3);
    let veil = Material {
        base_color: [0.25, 0.75, 0.65, 0.45],
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..color([1.0; 3], 0.0, 0.35)
    };
    builder.ball("veil", veil, [-6.4, -1.4], 0.95);
}

/// A knot of copper, upright behind the lamp.
fn knot(builder: &mut Builder) {
    let copper = builder.material("copper", color([0.95, 0.54, 0.40], 1.0, 0.18));
    let line = |t: f32| {
        let (sine, cosine) = (3.0 * t).sin_cos();
        let radius = 0.95 + 0.42 * cosine;
        Vec3::new(radius * (2.0 * t).cos(), radius * (2.0 * t).sin(), 0.42 * sine)
    };
    let shape = shapes::Mesh::default().grid(600, 40, |u, v| {
        let t = u * TAU;
        let forward = (line(t + 1e-2) - line(t - 1e-2)).normalize();
        let side = forward.cross(Vec3::Z).normalize();
        let (sine, cosine) = (v * TAU).sin_cos();
        line(t) + 0.24 * (side * cosine + forward.cross(side) * sine)
    });
    let mesh = builder.mesh("knot", &shape, copper);
    let upright = Quat::from_rotation_z(0.5 * PI);
    builder.place(mesh, Vec3::new(0.0, 1.62, -0.9), upright);
    let turns = (0..=4_u8).map(|quarter| Quat::from_rotation_y(0.5 * PI * f32::from(quarter)) * upright);
    builder.model.animations.push(Animation {
        name: Some("turn".into()),
        channels: vec![Channel {
            node: builder.model.nodes.len() - 1,
            path: ChannelPath::Rotation,
            keyframes: 0,
        }],
        keyframes: vec![Keyframes {
            interpolation: Interpolation::Linear,
            times: (0..=4_u8).map(|quarter| 0.25 * TURN * f32::from(quarter)).collect(),
            components: 4,
            values: turns.flat_map(|turn| turn.to_array()).collect(),
        }],
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_fits_together_and_stands_on_its_floor() {
        let model = showcase();
        for part in model.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            assert!(part.material.is_some_and(|material| material < model.materials.len()));
            assert!(part.indices.iter().all(|index| (*index as usize) < part.vertex_count()));
            assert_eq!(part.normals.len(), part.vertex_count());
        }
        let bounds = model.bounds(0, &model.pose(None, 0.0)).unwrap();
        assert!(bounds.min.y > -1e-3, "{bounds:?}");
        assert!(model.materials.iter().any(|material| material.sheen.is_some()));
    }

    #[test]
    fn two_calls_build_the_same_model() {
        assert_eq!(showcase(), showcase());
    }
}
