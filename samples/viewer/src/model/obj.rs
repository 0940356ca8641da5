//! Scenes of OBJ files as models.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec3;
use lvk_gltf::{
    AlphaMode, ColorSpace, Image, ImageData, Light, LightKind, Material, Mesh, MipLevel, Model, Node,
    Positions, Primitive, Projection, Sampler, TexelFormat, TextureRef, Transmission, Trs, Volume,
};
use lvk_samples::scene::{self, Scene};

/// A material of an OBJ file becomes a mesh of one primitive; the lamp stays where it is. A Phong exponent `n` becomes the
/// roughness whose GGX lobe is about as wide, `(2 / (n + 2))^(1/4)`.
pub(super) fn model(scene: &Scene) -> Model {
    let mut model = Model {
        default_scene: Some(0),
        images: scene.textures.iter().enumerate().map(|(source, texture)| image(source, texture)).collect(),
        samplers: vec![Sampler::default()],
        materials: scene.materials.iter().map(material).collect(),
        ..Model::default()
    };
    let mut triangles = BTreeMap::<u32, Vec<[u32; 3]>>::new();
    for (triangle, material) in scene.triangles.iter().zip(&scene.triangle_materials) {
        triangles.entry(*material).or_default().push(*triangle);
    }
    for (material, triangles) in triangles {
        let name = scene.materials.get(material as usize).map(|material| material.name.clone());
        let primitives = vec![primitive(scene, material as usize, &triangles)];
        model.meshes.push(Mesh { name, primitives, weights: Vec::new() });
        model.nodes.push(Node { mesh: Some(model.meshes.len() - 1), ..Node::default() });
    }
    add_lamp(&mut model, scene);
    add_cameras(&mut model, scene);
    let roots = (0..model.nodes.len()).collect();
    model.scenes.push(lvk_gltf::Scene { name: Some(scene.name.clone()), roots });
    model
}

fn image(source: usize, texture: &scene::Texture) -> Image {
    let level = MipLevel { width: texture.width, height: texture.height, bytes: texture.pixels.clone() };
    let data = Arc::new(ImageData { format: TexelFormat::Rgba8, mips: vec![level] });
    Image { name: Some(texture.name.clone()), source, color_space: ColorSpace::Srgb, data }
}

fn material(material: &scene::Material) -> Material {
    let is_glass = material.transmission > 0.0;
    let is_metal = material.reflectivity > 0.5;
    let color = if is_glass || is_metal { material.tint } else { material.albedo };
    let [red, green, blue] = color;
    let texture = |image| TextureRef { image, sampler: 0, tex_coord: 0, transform: None };
    Material {
        name: Some(material.name.clone()),
        base_color: [red, green, blue, 1.0],
        base_color_texture: material.albedo_texture.map(|image| texture(image as usize)),
        metallic: if is_metal { 1.0 } else { 0.0 },
        roughness: (2.0 / (material.shininess + 2.0)).sqrt().sqrt(),
        emissive: material.emission,
        alpha_mode: if material.is_masked { AlphaMode::Mask { cutoff: 0.5 } } else { AlphaMode::Opaque },
        double_sided: true,
        ior: material.ior,
        transmission: is_glass.then_some(Transmission { factor: material.transmission, texture: None }),
        volume: is_glass.then_some(Volume {
            thickness: 1.0,
            thickness_texture: None,
            attenuation_distance: f32::INFINITY,
            attenuation_color: [1.0; 3],
        }),
        ..Material::default()
    }
}

/// The triangles with the vertices that they use.
fn primitive(scene: &Scene, material: usize, triangles: &[[u32; 3]]) -> Primitive {
    let mut places = vec![u32::MAX; scene.positions.len()];
    let mut used = Vec::new();
    let mut place_of = |vertex: u32| {
        let place = &mut places[vertex as usize];
        if *place == u32::MAX {
            *place = used.len() as u32;
            used.push(vertex as usize);
        }
        *place
    };
    let indices = triangles.iter().flatten().map(|vertex| place_of(*vertex)).collect();
    let pick = |list: &[[f32; 3]]| used.iter().map(|vertex| list[*vertex]).collect::<Vec<_>>();
    let colors = if scene.colors.is_empty() { Vec::new() } else { pick(&scene.colors) };
    Primitive {
        positions: Positions::F32(pick(&scene.positions)),
        normals: pick(&scene.normals),
        tex_coords: vec![used.iter().map(|vertex| scene.texcoords[*vertex]).collect()],
        colors: colors.into_iter().map(|[red, green, blue]| [red, green, blue, 1.0]).collect(),
        indices,
        material: Some(material),
        ..Primitive::default()
    }
}

/// The lamp, with the light that it brings at its reach. Outdoors the sun and the sky suffice.
fn add_lamp(model: &mut Model, scene: &Scene) {
    if scene.sun.is_some() || scene.light.color == [0.0; 3] {
        return;
    }
    let brightest = Vec3::from(scene.light.color).max_element();
    let reach = scene.light.reach;
    model.lights.push(Light {
        name: Some("lamp".into()),
        color: scene.light.color.map(|channel| channel / brightest),
        intensity: brightest * reach * reach,
        range: None,
        kind: LightKind::Point,
    });
    let transform =
        lvk_gltf::Transform::Trs(Trs { translation: scene.light.position.into(), ..Trs::IDENTITY });
    model.nodes.push(Node { light: Some(0), transform, ..Node::default() });
}

/// The views of the scene, which lie inside of interiors.
fn add_cameras(model: &mut Model, scene: &Scene) {
    for (number, camera) in (1..).zip(&scene.cameras) {
        let yfov = camera.vertical_fov_degrees.to_radians();
        let projection = Projection::Perspective { yfov, aspect_ratio: None, znear: 0.01, zfar: None };
        let transform = lvk_gltf::Transform::Matrix(camera.view_from_world().inverse());
        model.nodes.push(Node { camera: Some(model.cameras.len()), transform, ..Node::default() });
        model.cameras.push(lvk_gltf::Camera { name: Some(format!("view {number}")), projection });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_triangle_of_the_courtyard_is_lost() {
        let scene = Scene::procedural();
        let model = model(&scene);
        let parts = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
        assert_eq!(parts.map(Primitive::triangle_count).sum::<usize>(), scene.triangles.len());
        for part in model.meshes.iter().flat_map(|mesh| &mesh.primitives) {
            assert!(part.indices.iter().all(|index| (*index as usize) < part.vertex_count()));
            assert!(part.material.is_some_and(|material| material < model.materials.len()));
        }
        assert!(model.materials.iter().any(|material| material.transmission.is_some()));
    }

    #[test]
    fn the_views_of_a_scene_are_its_first_cameras() {
        let scene = Scene::procedural();
        let model = model(&scene);
        let cameras = crate::model::cameras(&model, 0, &model.pose(None, 0.0));
        assert_eq!(cameras.len(), scene.cameras.len() + 1);
        for (found, own) in cameras.iter().zip(&scene.cameras) {
            let [wanted, turned] =
                [own, &found.camera].map(|camera| camera.view_from_world().to_cols_array());
            assert!(wanted.iter().zip(turned).all(|(a, b)| (a - b).abs() < 1e-4), "{}", found.name);
            assert!((found.camera.vertical_fov_degrees - own.vertical_fov_degrees).abs() < 1e-3);
        }
    }
}
