//! The scene that needs no file: a sunny courtyard with a pool, arcades, statues, mirrors and glass.

mod architecture;
mod atrium;
mod materials;
mod paint;
mod sculpture;
mod solid;
mod town;
mod tree;
mod valley;

use glam::Vec3;

pub(super) use self::atrium::atrium;
pub(crate) use self::paint::PAINTED;
use self::solid::Solids;
pub(super) use self::town::{carousel, town};
pub(crate) use self::valley::Valley;
use super::mesh::Mesh;
use super::setting::Setting;
use super::{Ambient, Camera, DirectionalLight, Material, PointLight, Scene, Sky, Texture, normals};

/// Implements [`Scene::procedural`].
pub(super) fn courtyard() -> Scene {
    let materials = materials::all();
    let (textures, (mesh, opaque_triangle_count)) = std::thread::scope(|scope| {
        let painter = scope.spawn(materials::textures);
        let built = build(&materials);
        (painter.join().unwrap_or_else(|_| materials::textures()), built)
    });
    let scene = setting().into_scene("courtyard".to_owned(), mesh, materials);
    Scene { opaque_triangle_count, textures, ..scene }
}

/// The courtyard's images.
pub(crate) fn painted_textures() -> Vec<Texture> {
    materials::textures()
}

/// The geometry, and how many of its triangles are opaque.
fn build(materials: &[Material]) -> (Mesh, u32) {
    let mut solids = Solids::new();
    architecture::build(&mut solids);
    sculpture::build(&mut solids);
    let mut mesh = solids.mesh;
    mesh.drop_degenerate();
    normals::complete(&mut mesh);
    let opaque_triangle_count = mesh.arrange(materials);
    (mesh, opaque_triangle_count)
}

/// A late afternoon: the sun warm from the left front, the shade blue, a lantern under the arches.
fn setting() -> Setting {
    let sun_direction = Vec3::new(-0.52, 0.68, 0.60).normalize().to_array();
    Setting {
        light: PointLight { position: [0.0, 2.55, -6.1], color: [2.6, 1.55, 0.7], reach: 2.2 },
        sun: Some(DirectionalLight { direction: sun_direction, color: [2.5, 2.0, 1.42] }),
        ambient: Ambient { above: [0.19, 0.25, 0.36], below: [0.19, 0.155, 0.12] },
        sky: Sky {
            zenith: [0.05, 0.17, 0.60],
            horizon: [0.66, 0.76, 0.88],
            ground: [0.19, 0.19, 0.10],
            sun_direction,
            sun_color: [16.0, 12.5, 8.5],
            clouds: 0.45,
        },
        cameras: [
            Camera::looking_at([0.4, 1.75, 8.9], [0.15, 1.2, 0.0], 40.0),
            Camera::looking_at([2.35, 0.62, 1.5], [-0.75, 1.02, -0.75], 58.0),
            Camera::looking_at([1.6, 1.7, 1.5], [4.4, 1.25, -2.0], 62.0),
            Camera::looking_at([1.3, 0.9, 6.0], [1.25, 0.5, 3.6], 50.0),
            Camera::looking_at([7.6, 5.6, 9.2], [-0.6, 0.4, -0.6], 42.0),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;
    use std::sync::LazyLock;

    static SCENE: LazyLock<Scene> = LazyLock::new(courtyard);

    #[test]
    fn the_courtyard_is_large_varied_and_the_same_every_time() {
        let scene = &*SCENE;
        assert!(scene.triangles.len() >= 100_000, "{}", scene.triangles.len());
        assert!(scene.materials.iter().any(|m| m.reflectivity > 0.5));
        assert!((scene.opaque_triangle_count as usize) < scene.triangles.len());
        assert!(
            scene
                .materials
                .iter()
                .filter_map(|m| m.albedo_texture)
                .all(|t| (t as usize) < scene.textures.len())
        );
        let again = courtyard();
        assert_eq!(scene.positions, again.positions);
        assert_eq!(scene.triangles, again.triangles);
        assert_eq!(scene.textures, again.textures);
    }

    #[test]
    fn every_material_is_used_and_every_normal_has_unit_length() {
        let scene = &*SCENE;
        let mut used = vec![false; scene.materials.len()];
        scene.triangle_materials.iter().for_each(|&material| used[material as usize] = true);
        assert!(used.iter().all(|&is_used| is_used), "{used:?}");
        assert!(scene.normals.iter().all(|&n| (Vec3::from(n).length() - 1.0).abs() < 1e-3));
        assert!(scene.texcoords.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn glass_is_watertight_and_its_normals_look_outwards() {
        let scene = &*SCENE;
        for name in ["glass", "green glass", "amber glass", "glow"] {
            let material = scene.materials.iter().position(|m| m.name == name).unwrap() as u32;
            let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
            let mut volume = 0.0;
            for (triangle, _) in
                scene.triangles.iter().zip(&scene.triangle_materials).filter(|(_, m)| **m == material)
            {
                let corners = triangle.map(|v| scene.positions[v as usize]);
                let [a, b, c] = corners.map(Vec3::from);
                volume += a.dot(b.cross(c)) / 6.0;
                let face = (b - a).cross(c - a);
                for vertex in triangle {
                    assert!(face.dot(scene.normals[*vertex as usize].into()) > 0.0, "{name}");
                }
                for i in 0..3 {
                    let ends = [corners[i], corners[(i + 1) % 3]].map(|p| p.map(|x| (x + 0.0).to_bits()));
                    *edges.entry([ends[0], ends[1]]).or_default() += 1;
                    *edges.entry([ends[1], ends[0]]).or_default() -= 1;
                }
            }
            assert!(volume > 0.0, "{name} is inside out");
            assert!(edges.values().all(|&balance| balance == 0), "{name} has open edges");
        }
    }
}
