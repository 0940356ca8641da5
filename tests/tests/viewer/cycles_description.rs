//! The description of a scene for Cycles, which `cycles.py` reads: JSON. Lists of numbers are printed by `Debug`, which writes JSON.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use lvk_gltf::{LightKind, Material, Model, Primitive};
use lvk_viewer::light::{Environment, SkyMap};

use crate::cycles_scenes::{ComparedScene, SIZE};
use crate::scenes::BOUNCES;

/// Returns the scene. Nodes must leave meshes where they are.
pub fn description(scene: &ComparedScene) -> String {
    let model = &scene.model;
    let primitives = model.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let surfaces: Vec<_> = primitives.map(|primitive| surface(model, primitive)).collect();
    let suns: Vec<_> = scene.environment.sun.iter().map(sun).collect();
    let sky = sky(&scene.environment);
    format!(
        r#"{{"surfaces": [{}], "lamps": [{}], "suns": [{}], "sky": {sky}, "view": {}, "bounces": {BOUNCES}}}"#,
        surfaces.join(", "),
        lamps(model).join(", "),
        suns.join(", "),
        view(scene)
    )
}

fn surface(model: &Model, primitive: &Primitive) -> String {
    let corners = || primitive.indices.iter().map(|index| *index as usize);
    let positions: Vec<_> = corners().map(|at| primitive.positions.get(at).unwrap()).collect();
    let tex_coords: Vec<_> =
        corners().map(|at| primitive.tex_coords.first().map_or([0.0; 2], |set| set[at])).collect();
    let colors: Vec<_> = corners().filter_map(|at| primitive.colors.get(at)).collect();
    let material = material(model, &model.materials[primitive.material.unwrap()], !colors.is_empty());
    format!(
        r#"{{"positions": {positions:?}, "tex_coords": {tex_coords:?}, "colors": {colors:?}, "material": {material}}}"#
    )
}

fn material(model: &Model, material: &Material, vertex_colors: bool) -> String {
    let Material { ior, roughness, emissive, emissive_strength, .. } = *material;
    let straight = (ior - 1.0) / (ior + 1.0);
    let extinction = material.volume.as_ref().map_or([0.0; 3], |volume| {
        volume.attenuation_color.map(|left| -left.ln() / volume.attenuation_distance)
    });
    format!(
        r#"{{"kind": {:?}, "color": {:?}, "roughness": {roughness:?}, "ior": {ior:?}, "f0": {:?}, "emission": {:?}, "extinction": {extinction:?}, "texture": {}, "vertex_colors": {vertex_colors}}}"#,
        kind(material),
        &material.base_color[..3],
        straight * straight,
        emissive.map(|light| light * emissive_strength),
        texture(model, material),
    )
}

/// The name of a material that both define alike.
fn kind(material: &Material) -> &'static str {
    let is_smooth = material.roughness == 0.0;
    let is_white = material.base_color == [1.0; 4];
    let is_dull = material.specular.as_ref().is_some_and(|specular| specular.factor == 0.0);
    let is_clear = material.transmission.as_ref().is_some_and(|transmission| transmission.factor == 1.0);
    let is_volume = material.volume.as_ref().is_some_and(|volume| volume.thickness > 0.0);
    match material {
        _ if material.emissive != [0.0; 3] => {
            assert!(is_dull && material.base_color[..3] == [0.0; 3], "a lamp that reflects");
            "emitter"
        }
        _ if material.metallic == 1.0 && is_smooth => "mirror",
        _ if material.metallic == 1.0 && is_white => "white metal",
        _ if is_clear && is_smooth && is_volume && is_white => "glass",
        _ if is_clear && is_smooth && !is_volume => "pane",
        _ if material.metallic == 0.0 && is_dull => "matte",
        _ if material.metallic == 0.0 && is_smooth => "plastic",
        _ => panic!("Cycles has no material like {material:?}"),
    }
}

fn texture(model: &Model, material: &Material) -> String {
    let Some(texture) = material.base_color_texture else { return "null".to_owned() };
    let level = &model.images[texture.image].data.mips[0];
    let texels: Vec<_> = level.bytes.chunks(4).map(|texel| &texel[..3]).collect();
    format!(r#"{{"size": [{}, {}], "texels": {texels:?}}}"#, level.width, level.height)
}

fn lamps(model: &Model) -> Vec<String> {
    let pose = model.pose(None, 0.0);
    let lamps = model.nodes.iter().zip(&pose.world).filter_map(|(node, world)| {
        let light = &model.lights[node.light?];
        assert!(light.kind == LightKind::Point && light.range.is_none(), "Cycles has no lamp like {light:?}");
        let intensity = light.color.map(|channel| channel * light.intensity);
        Some(format!(r#"{{"place": {:?}, "intensity": {intensity:?}}}"#, world.w_axis.truncate().to_array()))
    });
    lamps.collect()
}

fn sun(sun: &lvk_viewer::light::Sun) -> String {
    let lvk_viewer::light::Sun { direction, irradiance, radius } = sun;
    format!(r#"{{"direction": {direction:?}, "irradiance": {irradiance:?}, "radius": {radius:?}}}"#)
}

fn sky(environment: &Environment) -> String {
    let SkyMap { width, height, texels } = &environment.sky;
    assert!(
        *width == 2 && *height == 2 && texels[0] == texels[1] && texels[2] == texels[3],
        "a sky of two rows"
    );
    format!(r#"{{"upper": {:?}, "lower": {:?}}}"#, texels[0], texels[2])
}

fn view(scene: &ComparedScene) -> String {
    let camera = &scene.camera;
    let fov = camera.vertical_fov_degrees.to_radians();
    let (axes, eye) = (camera.frame(), camera.eye);
    format!(r#"{{"axes": {axes:?}, "eye": {eye:?}, "vertical_fov": {fov:?}, "size": {SIZE:?}}}"#)
}
