//! Models of a few triangles, and what the viewer makes of them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Arc;

use glam::{Mat4, Vec3};
use lvk::Context;
use lvk_gltf::{
    ColorSpace, Image, ImageData, Light, Material, Mesh, Model, Node, Positions, Primitive, Sampler,
    Specular, Transform,
};
use lvk_samples::app::headless;
use lvk_samples::app::sample::Sample as _;
use lvk_samples::hybrid::RayPath;
use lvk_samples::scene::Camera;
use lvk_viewer::light::Environment;
use lvk_viewer::{Method, Viewer, ViewerConfig, ViewerScene};

/// Surfaces of a path at most.
pub const BOUNCES: u32 = 64;

/// A model while it is put together. Each shape is a mesh and a node of its own.
#[derive(Default)]
pub struct Builder {
    model: Model,
}

impl Builder {
    /// Adds a parallelogram that is seen from `u x v`.
    pub fn quad(mut self, corner: Vec3, u: Vec3, v: Vec3, material: Material) -> Self {
        let normal = u.cross(v).normalize().to_array();
        let positions = [corner, corner + u, corner + u + v, corner + v].map(|position| position.to_array());
        self.model.materials.push(material);
        let primitive = Primitive {
            positions: Positions::F32(positions.to_vec()),
            normals: vec![normal; 4],
            tex_coords: vec![vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]],
            indices: vec![0, 1, 2, 0, 2, 3],
            material: Some(self.model.materials.len() - 1),
            ..Primitive::default()
        };
        self.model.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        self.model.nodes.push(Node { mesh: Some(self.model.meshes.len() - 1), ..Node::default() });
        self
    }

    /// Adds a box that is seen from outside.
    pub fn cuboid(self, low: Vec3, high: Vec3, material: &Material) -> Self {
        let size = high - low;
        let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
        let sides = [(low, y, x), (low, z, y), (low, x, z), (high, -x, -y), (high, -y, -z), (high, -z, -x)];
        sides.into_iter().fold(self, |builder, (corner, u, v)| builder.quad(corner, u, v, material.clone()))
    }

    /// Adds flat triangles that are seen from where they turn counter-clockwise.
    pub fn facets(mut self, triangles: &[[Vec3; 3]], material: &Material) -> Self {
        self.model.materials.push(material.clone());
        let normal = |[a, b, c]: &[Vec3; 3]| [(*b - *a).cross(*c - *a).normalize().to_array(); 3];
        let positions = triangles.as_flattened().iter().map(|position| position.to_array()).collect();
        let primitive = Primitive {
            positions: Positions::F32(positions),
            normals: triangles.iter().flat_map(normal).collect(),
            indices: (0..3 * triangles.len() as u32).collect(),
            material: Some(self.model.materials.len() - 1),
            ..Primitive::default()
        };
        self.model.meshes.push(Mesh { primitives: vec![primitive], ..Mesh::default() });
        self.model.nodes.push(Node { mesh: Some(self.model.meshes.len() - 1), ..Node::default() });
        self
    }

    /// Adds an image in sRGB, whose number is 0, and the usual sampler.
    pub fn image(mut self, data: &Arc<ImageData>) -> Self {
        let data = Arc::clone(data);
        self.model.images = vec![Image { name: None, source: 0, color_space: ColorSpace::Srgb, data }];
        self.model.samplers = vec![Sampler::default()];
        self
    }

    /// Adds a light that stands at a point and shines down.
    pub fn lamp(mut self, light: Light, place: Vec3) -> Self {
        self.model.lights.push(light);
        let down = Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
        let transform = Transform::Matrix(Mat4::from_translation(place) * down);
        self.model.nodes.push(Node {
            light: Some(self.model.lights.len() - 1),
            transform,
            ..Node::default()
        });
        self
    }

    /// Returns the model.
    pub fn model(mut self) -> Model {
        let roots = (0..self.model.nodes.len()).collect();
        self.model.scenes = vec![lvk_gltf::Scene { name: None, roots }];
        self.model.default_scene = Some(0);
        self.model
    }
}

/// A material of this colour.
pub fn colored([red, green, blue]: [f32; 3], metallic: f32, roughness: f32) -> Material {
    Material { base_color: [red, green, blue, 1.0], metallic, roughness, ..Material::default() }
}

/// A material that scatters light evenly, without a highlight.
pub fn matte(color: [f32; 3]) -> Material {
    let specular = Specular { factor: 0.0, texture: None, color: [1.0; 3], color_texture: None };
    Material { specular: Some(specular), ..colored(color, 0.0, 1.0) }
}

/// A way to look at a scene.
#[derive(Debug, Clone, Copy)]
pub struct View {
    pub camera: Camera,
    pub size: [u32; 2],
    pub samples: u32,
}

/// Returns the viewer of a model by a method.
pub fn viewer(
    ctx: &Context,
    (method, path): (Method, RayPath),
    model: &Model,
    environment: &Environment,
    view: &View,
) -> Viewer {
    configured_viewer(ctx, &config((method, path), view), model, environment, view)
}

/// Returns the usual configuration.
pub fn config((method, path): (Method, RayPath), view: &View) -> ViewerConfig {
    let [width, height] = view.size;
    let usual = ViewerConfig::new(path, width, height);
    ViewerConfig { method, samples: view.samples, bounces: BOUNCES, ..usual }
}

/// Returns the viewer of a model in a configuration.
pub fn configured_viewer(
    ctx: &Context,
    config: &ViewerConfig,
    model: &Model,
    environment: &Environment,
    view: &View,
) -> Viewer {
    let mut viewer = Viewer::new(ctx, scene(model, environment), config).unwrap();
    viewer.set_view(&view.camera);
    viewer
}

/// Returns a model with its light.
pub fn scene(model: &Model, environment: &Environment) -> ViewerScene {
    ViewerScene {
        name: "test".to_owned(),
        model: model.clone(),
        environment: environment.clone(),
        disc_radius: 0.1,
    }
}

/// The path tracer by queries, which shows one scene after the other: its pipelines take longer to compile than most scenes to render.
pub struct PathTracer<'a> {
    ctx: &'a Context,
    viewer: Option<Viewer>,
}

impl<'a> PathTracer<'a> {
    pub fn new(ctx: &'a Context) -> Self {
        Self { ctx, viewer: None }
    }

    /// Returns the radiance of each pixel, rows from the top.
    pub fn radiance(&mut self, model: &Model, environment: &Environment, view: &View) -> Vec<[f32; 3]> {
        let by = (Method::PathTrace, RayPath::Query);
        let viewer = match &mut self.viewer {
            Some(viewer) => {
                viewer.show(scene(model, environment)).unwrap();
                viewer.configure(&config(by, view)).unwrap();
                viewer.set_view(&view.camera);
                viewer
            }
            none => none.insert(viewer(self.ctx, by, model, environment, view)),
        };
        headless::picture(viewer).unwrap();
        viewer.radiance().unwrap()
    }
}

/// Returns the radiance of each pixel by the path tracer, rows from the top.
pub fn radiance(
    ctx: &Context,
    path: RayPath,
    model: &Model,
    environment: &Environment,
    view: &View,
) -> Vec<[f32; 3]> {
    radiance_by(ctx, (Method::PathTrace, path), model, environment, view)
}

/// Returns the radiance of each pixel by a method.
pub fn radiance_by(
    ctx: &Context,
    by: (Method, RayPath),
    model: &Model,
    environment: &Environment,
    view: &View,
) -> Vec<[f32; 3]> {
    let mut viewer = viewer(ctx, by, model, environment, view);
    headless::picture(&mut viewer).unwrap();
    viewer.radiance().unwrap()
}

/// The mean of all pixels.
pub fn mean(pixels: &[[f32; 3]]) -> [f64; 3] {
    let sum = |channel: usize| pixels.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>();
    [0, 1, 2].map(|channel| sum(channel) / pixels.len() as f64)
}

/// Asserts that each channel of `actual` is within a share of `expected`.
pub fn assert_close(what: &str, actual: [f64; 3], expected: [f64; 3], share: f64) {
    let is_close = actual
        .iter()
        .zip(expected)
        .all(|(actual, expected)| (actual - expected).abs() <= share * expected.max(1e-3));
    eprintln!("{what}: {actual:.4?}, expected {expected:.4?}");
    assert!(is_close, "{what}: {actual:?} is not within {share} of {expected:?}");
}
