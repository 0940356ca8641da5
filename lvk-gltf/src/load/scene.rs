//! Scenes, nodes, cameras and lights.

use glam::{Mat4, Quat, Vec3};
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::extensions::scene::khr_lights_punctual as json_light;
use gltf::json::validation::Checked;

use super::accessors::{Accessor, Accessors};
use super::extensions::Instancing;
use super::place::place;
use crate::{Camera, Light, LightKind, Node, Problem, Projection, Scene, Transform, Trs, Warning};

/// Reads scenes. Their roots are nodes without parent, each at most once.
pub(super) fn read_scenes(json: &gltf::json::Root, nodes: &[Node]) -> Result<Vec<Scene>, Problem> {
    let mut scenes = Vec::new();
    let mut scene_of_root = vec![None; nodes.len()];
    for (index, scene) in json.scenes.iter().enumerate() {
        let roots: Vec<usize> = scene.nodes.iter().map(|node| node.value()).collect();
        for root in &roots {
            let problem = |what: String| {
                let node = place("node", *root, nodes[*root].name.as_deref());
                let scene = place("scene", index, scene.name.as_deref());
                Problem::Hierarchy { place: format!("{scene}, {node}"), what }
            };
            if let Some(parent) = nodes[*root].parent {
                return Err(problem(format!("is a root and has the parent {parent}")));
            }
            if scene_of_root[*root].replace(index) == Some(index) {
                return Err(problem("is a root twice".into()));
            }
        }
        scenes.push(Scene { name: scene.name.clone(), roots });
    }
    Ok(scenes)
}

/// Reads nodes, and checks that they form trees.
pub(super) fn read_nodes(
    accessors: Accessors<'_>,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Node>, Problem> {
    let document = accessors.document;
    let mut nodes = Vec::new();
    for (index, json) in document.root.nodes.iter().enumerate() {
        let place = place("node", index, json.name.as_deref());
        let extensions = document.extensions.nodes.get(index).map(|node| &node.extensions);
        let instancing = extensions.and_then(|extensions| extensions.instancing.as_ref());
        let light = json.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        nodes.push(Node {
            name: json.name.clone(),
            parent: None,
            children: json.children.iter().flatten().map(|child| child.value()).collect(),
            transform: read_transform(json, &place, warnings)?,
            mesh: json.mesh.map(|mesh| mesh.value()),
            skin: json.skin.map(|skin| skin.value()).filter(|_| json.mesh.is_some()),
            camera: json.camera.map(|camera| camera.value()),
            light: light.map(|light| light.light.value()),
            weights: json.weights.clone().unwrap_or_default(),
            instances: instancing.map(|it| read_instances(accessors, it, &place, warnings)).transpose()?,
        });
    }
    link(&mut nodes)?;
    Ok(nodes)
}

/// Sets the parents. Refuses two parents, and circles.
fn link(nodes: &mut [Node]) -> Result<(), Problem> {
    let name = |nodes: &[Node], index: usize| place("node", index, nodes[index].name.as_deref());
    for parent in 0..nodes.len() {
        for child in std::mem::take(&mut nodes[parent].children) {
            if let Some(other) = nodes[child].parent {
                let what = format!("has the parents {other} and {parent}");
                return Err(Problem::Hierarchy { place: name(nodes, child), what });
            }
            nodes[child].parent = Some(parent);
            nodes[parent].children.push(child);
        }
    }
    let mut reached: Vec<bool> = nodes.iter().map(|node| node.parent.is_none()).collect();
    let mut open: Vec<usize> = (0..nodes.len()).filter(|node| reached[*node]).collect();
    while let Some(node) = open.pop() {
        for child in &nodes[node].children {
            reached[*child] = true;
            open.push(*child);
        }
    }
    let in_circle = reached.iter().position(|reached| !reached);
    let what = "is its own ancestor".to_owned();
    in_circle.map_or(Ok(()), |node| Err(Problem::Hierarchy { place: name(nodes, node), what }))
}

fn read_transform(
    json: &gltf::json::Node,
    place: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Transform, Problem> {
    let check = |what: &str, numbers: &[f32]| {
        let finite = numbers.iter().all(|number| number.is_finite());
        let problem = || Problem::NotFinite { place: place.into(), what: format!("its {what}") };
        if finite { Ok(()) } else { Err(problem()) }
    };
    if let Some(matrix) = &json.matrix {
        check("matrix", matrix)?;
        let matrix = Mat4::from_cols_array(matrix);
        if !matrix.row(3).abs_diff_eq(glam::Vec4::W, 1e-5) {
            let rule = "the last row of its matrix is not 0, 0, 0, 1".into();
            return Err(Problem::Rule { place: place.into(), rule });
        }
        return Ok(Transform::Matrix(matrix));
    }
    let mut trs = Trs::IDENTITY;
    if let Some(translation) = &json.translation {
        check("translation", translation)?;
        trs.translation = Vec3::from(*translation);
    }
    if let Some(scale) = &json.scale {
        check("scale", scale)?;
        trs.scale = Vec3::from(*scale);
    }
    if let Some(rotation) = &json.rotation {
        check("rotation", &rotation.0)?;
        let (rotation, is_unit) = unit_quaternion(rotation.0);
        trs.rotation = rotation;
        if !is_unit {
            let what = "a rotation that is not of unit length".into();
            warnings.push(Warning::Corrected { place: place.into(), what });
        }
    }
    Ok(Transform::Trs(trs))
}

/// Returns a quaternion of unit length, and says whether it was one, within what exporters round.
fn unit_quaternion(rotation: [f32; 4]) -> (Quat, bool) {
    let length = glam::DVec4::from_array(rotation.map(f64::from)).length();
    let is_unit = (length - 1.0).abs() < 1e-2;
    let unit = glam::DVec4::from_array(rotation.map(f64::from)) / length;
    (if length > 0.0 { Quat::from_vec4(unit.as_vec4()) } else { Quat::IDENTITY }, is_unit)
}

fn read_instances(
    accessors: Accessors<'_>,
    instancing: &Instancing,
    place: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Trs>, Problem> {
    let place = format!("{place}, EXT_mesh_gpu_instancing");
    let mut count = None;
    let mut lists = [None, None, None];
    for (name, index) in &instancing.attributes {
        let accessor = accessors.open(*index as usize, &place)?;
        accessor.check_count(*count.get_or_insert(accessor.count))?;
        match name.as_str() {
            "TRANSLATION" => lists[0] = Some(vectors(&accessor, Type::Vec3, "VEC3 of FLOAT")?),
            "ROTATION" => lists[1] = Some(vectors(&accessor, Type::Vec4, "VEC4 of FLOAT, BYTE or SHORT")?),
            "SCALE" => lists[2] = Some(vectors(&accessor, Type::Vec3, "VEC3 of FLOAT")?),
            _ => {
                let feature = format!("attribute {}", super::place::shortened(name));
                warnings.push(Warning::FeatureIgnored { place: place.clone(), feature });
            }
        }
    }
    let [translations, rotations, scales] = lists;
    let count = count.unwrap_or(0);
    let mut instances = accessors.budget.list(count, || place.clone())?;
    let at = |list: &Option<Vec<[f32; 4]>>, index: usize| list.as_ref().map(|list| list[index]);
    instances.extend((0..count as usize).map(|index| Trs {
        translation: at(&translations, index).map_or(Vec3::ZERO, |[x, y, z, _]| Vec3::new(x, y, z)),
        rotation: at(&rotations, index).map_or(Quat::IDENTITY, |rotation| unit_quaternion(rotation).0),
        scale: at(&scales, index).map_or(Vec3::ONE, |[x, y, z, _]| Vec3::new(x, y, z)),
    }));
    Ok(instances)
}

fn vectors(accessor: &Accessor<'_>, shape: Type, wanted: &'static str) -> Result<Vec<[f32; 4]>, Problem> {
    let small = matches!(accessor.component, ComponentType::I8 | ComponentType::I16) && accessor.normalized;
    let right = accessor.component == ComponentType::F32 || shape == Type::Vec4 && small;
    if accessor.shape != shape || !right {
        return Err(accessor.wrong_type(wanted));
    }
    accessor.read_floats(0.0)
}

/// Reads cameras.
pub(super) fn read_cameras(json: &gltf::json::Root) -> Result<Vec<Camera>, Problem> {
    let camera = |(index, json): (usize, &gltf::json::Camera)| {
        let place = place("camera", index, json.name.as_deref());
        read_projection(json, place).map(|projection| Camera { name: json.name.clone(), projection })
    };
    json.cameras.iter().enumerate().map(camera).collect()
}

fn read_projection(json: &gltf::json::Camera, place: String) -> Result<Projection, Problem> {
    use gltf::json::camera::Type::{Orthographic, Perspective};
    let (projection, is_right) = match (json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(Perspective), Some(json), _) => {
            let numbers = [Some(json.yfov), Some(json.znear), json.aspect_ratio, json.zfar];
            let positive = numbers.into_iter().flatten().all(|number| number > 0.0 && number.is_finite());
            let is_right =
                positive && json.yfov < std::f32::consts::PI && json.zfar.is_none_or(|far| far > json.znear);
            let (aspect_ratio, yfov, znear, zfar) = (json.aspect_ratio, json.yfov, json.znear, json.zfar);
            (Projection::Perspective { yfov, aspect_ratio, znear, zfar }, is_right)
        }
        (Checked::Valid(Orthographic), _, Some(json)) => {
            let finite =
                [json.xmag, json.ymag, json.znear, json.zfar].iter().all(|number| number.is_finite());
            let is_right =
                finite && json.xmag != 0.0 && json.ymag != 0.0 && json.znear >= 0.0 && json.zfar > json.znear;
            let (xmag, ymag) = (json.xmag.abs(), json.ymag.abs());
            (Projection::Orthographic { xmag, ymag, znear: json.znear, zfar: json.zfar }, is_right)
        }
        _ => return Err(Problem::Rule { place, rule: "it lacks the properties of its type".into() }),
    };
    if is_right {
        return Ok(projection);
    }
    let rule = "a field of view, a size or the distance of a plane is out of range".into();
    Err(Problem::Rule { place, rule })
}

/// Reads the lights of `KHR_lights_punctual`.
pub(super) fn read_lights(
    json: &gltf::json::Root,
    warnings: &mut Vec<Warning>,
) -> Result<Vec<Light>, Problem> {
    let extension = json.extensions.as_ref().and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    let lights = extension.map_or(&[][..], |extension| &extension.lights);
    lights.iter().enumerate().map(|(index, json)| read_light(index, json, warnings)).collect()
}

fn read_light(index: usize, json: &json_light::Light, warnings: &mut Vec<Warning>) -> Result<Light, Problem> {
    let place = place("light", index, json.name.as_deref());
    let spot = json.spot.clone().unwrap_or_default();
    let [red, green, blue] = json.color;
    let range = json.range.unwrap_or(1.0);
    let numbers = [red, green, blue, json.intensity, range, spot.inner_cone_angle, spot.outer_cone_angle];
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err(Problem::NotFinite { place, what: "a property".into() });
    }
    let kind = match json.type_ {
        Checked::Valid(json_light::Type::Directional) => LightKind::Directional,
        Checked::Valid(json_light::Type::Point) => LightKind::Point,
        _ => {
            let outer_cone_angle = spot.outer_cone_angle.clamp(1e-3, std::f32::consts::FRAC_PI_2);
            let inner_cone_angle = spot.inner_cone_angle.clamp(0.0, outer_cone_angle - 1e-4);
            LightKind::Spot { inner_cone_angle, outer_cone_angle }
        }
    };
    let angles = match kind {
        LightKind::Spot { inner_cone_angle, outer_cone_angle } => [inner_cone_angle, outer_cone_angle],
        _ => [spot.inner_cone_angle, spot.outer_cone_angle],
    };
    let intensity = json.intensity.max(0.0);
    let color = json.color.map(|component| component.max(0.0));
    let range = json.range.filter(|range| *range > 0.0);
    let is_same = angles == [spot.inner_cone_angle, spot.outer_cone_angle]
        && (intensity, color, range) == (json.intensity, json.color, json.range);
    if !is_same {
        let what = "a colour, an intensity, a range or an angle that is out of range".into();
        warnings.push(Warning::Corrected { place, what });
    }
    Ok(Light { name: json.name.clone(), color, intensity, range, kind })
}
