//! Scenes that the viewer and Cycles define alike: flat facets, and materials that nodes of Cycles can repeat.

use std::f32::consts::TAU;
use std::sync::Arc;

use glam::{Quat, Vec3};
use lvk_gltf::{
    ColorSpace, Filter, Image, ImageData, Light, LightKind, Material, MipLevel, Model, Sampler, TexelFormat,
    TextureRef, Transmission, Volume, Wrap,
};
use lvk_samples::scene::Camera;
use lvk_viewer::light::{Environment, SkyMap, Sun};

use crate::scenes::{Builder, colored, matte};

/// Pixels of a picture.
pub const SIZE: [u32; 2] = [160, 120];

/// A scene, and how it is seen.
pub struct ComparedScene {
    pub name: &'static str,
    pub model: Model,
    pub environment: Environment,
    pub camera: Camera,
    /// The relative error of a block that is too large: twice what 1,024 samples have, so that something local is seen.
    pub block_limit: f64,
}

/// Matte walls and blocks, lit by one lamp of an area and, from the open side, by a dim sky.
pub fn matte_box() -> ComparedScene {
    let white = matte([0.75, 0.74, 0.7]);
    let model = interior([matte([0.65, 0.08, 0.06]), matte([0.12, 0.45, 0.1]), white.clone()], &white)
        .quad(Vec3::new(-0.6, 3.98, -0.6), Vec3::X * 1.2, Vec3::Z * 1.2, glowing([17.0, 12.0, 7.0]))
        .facets(&turned_block(Vec3::new(-0.75, 1.2, -0.8), Vec3::new(0.6, 1.2, 0.6), 0.3), &matte([0.5; 3]))
        .facets(&turned_block(Vec3::new(0.8, 0.6, 0.5), Vec3::splat(0.6), -0.3), &matte([0.85, 0.8, 0.3]))
        .model();
    ComparedScene {
        name: "box",
        model,
        environment: Environment::uniform([0.1; 3]),
        camera: before_the_interior(),
        block_limit: 0.06,
    }
}

/// A floor of tiles with matte blocks under a sky of two colours, a sun and a lamp.
pub fn terrace() -> ComparedScene {
    let lamp =
        Light { name: None, color: [1.0, 0.55, 0.25], intensity: 2.4, range: None, kind: LightKind::Point };
    let mut model = Builder::default()
        .quad(Vec3::new(-6.0, 0.0, -6.0), Vec3::Z * 12.0, Vec3::X * 12.0, tiled())
        .quad(Vec3::new(-6.0, 0.0, -2.5), Vec3::X * 12.0, Vec3::Y * 7.0, matte([1.0; 3]))
        .facets(&turned_block(Vec3::new(-1.3, 0.8, -0.6), Vec3::new(0.5, 0.8, 0.5), 0.5), &matte([0.8; 3]))
        .facets(&gem(Vec3::new(0.4, 0.65, 0.3), 0.65), &matte([0.9, 0.5, 0.2]))
        .facets(&gem(Vec3::new(1.7, 0.5, -0.9), 0.5), &matte([0.2, 0.35, 0.8]))
        .lamp(lamp, Vec3::new(-0.3, 1.5, 1.1))
        .model();
    model.images = vec![tiles()];
    let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::Repeat);
    let [mag_filter, min_filter] = [Filter::Nearest; 2];
    model.samplers = vec![Sampler { mag_filter, min_filter, mip_filter: None, wrap_u, wrap_v }];
    model.meshes[1].primitives[0].colors =
        vec![[0.8, 0.3, 0.2, 1.0], [0.2, 0.7, 0.3, 1.0], [0.2, 0.3, 0.9, 1.0], [0.9, 0.8, 0.3, 1.0]];
    let direction = Vec3::new(0.55, 0.6, 0.45).normalize().to_array();
    let sun = Sun { direction, irradiance: [2.6, 2.3, 1.9], radius: 0.03 };
    let environment = Environment { sky: sky([0.35, 0.5, 0.9], [0.25, 0.2, 0.15]), sun: Some(sun) };
    let camera = Camera::looking_at([0.6, 2.2, 5.2], [0.1, 0.8, 0.0], 38.0);
    ComparedScene { name: "terrace", model, environment, camera, block_limit: 0.03 }
}

/// Smooth dielectrics and metals in a box that is lit from above and from the open side.
pub fn cabinet() -> ComparedScene {
    let transmission = Some(Transmission { factor: 1.0, texture: None });
    let volume = Some(Volume {
        thickness: 1.0,
        thickness_texture: None,
        attenuation_distance: 0.8,
        attenuation_color: [0.45, 0.85, 0.6],
    });
    let glass = Material { transmission, volume, ..colored([1.0; 3], 0.0, 0.0) };
    let pane = Material { transmission, ..colored([0.9, 0.65, 0.3], 0.0, 0.0) };
    let plastic = colored([0.1, 0.2, 0.7], 0.0, 0.0);
    let mirror = colored([0.95, 0.7, 0.35], 1.0, 0.0);
    let wall = matte([0.7, 0.68, 0.65]);
    let floor = Material { ior: 1.6, ..colored([0.45, 0.25, 0.15], 0.0, 0.0) };
    let model = interior([matte([0.25, 0.5, 0.6]), matte([0.7, 0.35, 0.3]), wall], &floor)
        .quad(Vec3::new(-1.4, 3.98, -1.4), Vec3::X * 2.8, Vec3::Z * 2.8, glowing([3.4, 3.2, 3.0]))
        .facets(&gem(Vec3::new(-1.0, 0.75, 0.4), 0.7), &glass)
        .facets(&turned_block(Vec3::new(0.1, 0.9, -1.1), Vec3::new(0.6, 0.9, 0.4), 0.35), &mirror)
        .facets(&gem(Vec3::new(1.1, 0.6, -0.1), 0.6), &plastic)
        .quad(Vec3::new(0.2, 0.01, 1.0), Vec3::X * 1.2, Vec3::Y * 0.9, pane)
        .model();
    let environment = Environment { sky: sky([0.5, 0.6, 0.8], [0.3, 0.28, 0.25]), sun: None };
    ComparedScene { name: "cabinet", model, environment, camera: before_the_interior(), block_limit: 0.06 }
}

/// White metals of several roughnesses in the same light.
pub fn metals() -> ComparedScene {
    let wall = matte([0.6; 3]);
    let interior = interior([matte([0.7, 0.2, 0.15]), matte([0.15, 0.3, 0.7]), wall.clone()], &wall).quad(
        Vec3::new(-1.2, 3.98, -1.2),
        Vec3::X * 2.4,
        Vec3::Z * 2.4,
        glowing([4.5, 4.2, 3.8]),
    );
    let roughness = [0.2, 0.4, 0.6, 0.8, 1.0];
    let places = [(-1.3, -0.9), (0.0, -1.1), (1.3, -0.9), (-0.7, 0.5), (0.7, 0.5)];
    let model = places
        .into_iter()
        .zip(roughness)
        .fold(interior, |builder, ((x, z), roughness)| {
            builder.facets(&gem(Vec3::new(x, 0.62, z), 0.6), &colored([1.0; 3], 1.0, roughness))
        })
        .model();
    let environment = Environment { sky: sky([0.5, 0.6, 0.8], [0.3, 0.28, 0.25]), sun: None };
    ComparedScene { name: "metals", model, environment, camera: before_the_interior(), block_limit: 0.13 }
}

/// A box of 4 units that is open towards +z: walls on the left, on the right, and behind and above; and the floor.
fn interior([left, right, other]: [Material; 3], floor: &Material) -> Builder {
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 4.0, 2.0));
    let [x, y, z] = [Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Z * 4.0];
    Builder::default()
        .quad(low, z, x, floor.clone())
        .quad(low, y, z, left)
        .quad(high, -z, -y, right)
        .quad(low, x, y, other.clone())
        .quad(high, -x, -z, other)
}

fn before_the_interior() -> Camera {
    Camera::looking_at([0.0, 2.3, 7.4], [0.0, 1.75, 0.0], 36.0)
}

fn glowing(emissive: [f32; 3]) -> Material {
    Material { emissive, ..matte([0.0; 3]) }
}

fn sky(upper: [f32; 3], lower: [f32; 3]) -> SkyMap {
    SkyMap { width: 2, height: 2, texels: vec![upper, upper, lower, lower] }
}

/// Triangles of a block that is turned around the vertical, seen from outside.
fn turned_block(middle: Vec3, half: Vec3, turn: f32) -> Vec<[Vec3; 3]> {
    let rotation = Quat::from_rotation_y(turn);
    let at = |corner: [f32; 3]| middle + rotation * (half * Vec3::from(corner));
    // An axis, and the two that follow it.
    let faces = (0..3).flat_map(|axis| [-1.0_f32, 1.0].map(|side| (axis, side)));
    let triangles = faces.flat_map(|(axis, side)| {
        let corner = |u: f32, v: f32| {
            let mut corner = [0.0; 3];
            corner[axis] = side;
            corner[(axis + 1) % 3] = side * u;
            corner[(axis + 2) % 3] = v;
            at(corner)
        };
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, d]]
    });
    triangles.collect()
}

/// Triangles of a cut stone: rings of eight corners between two tips, seen from outside.
fn gem(middle: Vec3, radius: f32) -> Vec<[Vec3; 3]> {
    const SIDES: u32 = 8;
    let rings = [(-0.98_f32, 0.0), (-0.5, 0.8), (0.25, 1.0), (0.75, 0.62), (0.75, 0.0)];
    let at = |ring: usize, side: u32| {
        let (height, width) = rings[ring];
        let (sine, cosine) = ((side % SIDES) as f32 / SIDES as f32 * TAU + 0.2).sin_cos();
        middle + radius * Vec3::new(width * sine, height, width * cosine)
    };
    let bands = (0..rings.len() - 1).flat_map(|ring| (0..SIDES).map(move |side| (ring, side)));
    let triangles = bands.flat_map(|(ring, side)| {
        let [a, b] = [at(ring, side), at(ring, side + 1)];
        let [c, d] = [at(ring + 1, side + 1), at(ring + 1, side)];
        [[a, b, c], [a, c, d]]
    });
    triangles.filter(|[a, b, c]| (*b - *a).cross(*c - *a).length() > 1e-6).collect()
}

fn tiled() -> Material {
    let texture = TextureRef { image: 0, sampler: 0, tex_coord: 0, transform: None };
    Material { base_color_texture: Some(texture), ..matte([0.9, 0.95, 1.0]) }
}

/// Sixteen tiles in a row, of five colours.
fn tiles() -> Image {
    const SIDE: u32 = 16;
    let colors: [[u8; 4]; 5] = [
        [230, 225, 210, 255],
        [120, 60, 50, 255],
        [60, 95, 120, 255],
        [190, 150, 90, 255],
        [90, 130, 80, 255],
    ];
    let bytes = (0..SIDE * SIDE)
        .flat_map(|texel| colors[((texel % SIDE + 2 * (texel / SIDE)) % 5) as usize])
        .collect();
    let level = MipLevel { width: SIDE, height: SIDE, bytes };
    let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
    Image { name: None, source: 0, color_space: ColorSpace::Srgb, data }
}
