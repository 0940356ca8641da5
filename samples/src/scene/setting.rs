//! Lights, sky and cameras around a mesh.

use glam::Vec3;

use super::camera_file::Views;
use super::mesh::Mesh;
use super::{Ambient, Camera, DirectionalLight, Material, PointLight, Scene, Sky, bounds_of, framing};

/// Irradiance of a surface that faces the sun.
const SUN_COLOR: [f32; 3] = [1.5, 1.38, 1.15];

/// Lights, sky and cameras around a mesh.
pub(super) struct Setting {
    pub light: PointLight,
    pub sun: Option<DirectionalLight>,
    pub ambient: Ambient,
    pub sky: Sky,
    pub cameras: [Camera; 5],
}

impl Setting {
    /// The setting of a mesh from a file: the given views, filled up with views computed from the geometry.
    pub fn from_mesh(mesh: &Mesh, views: Option<Views>) -> Self {
        let (low, high) = bounds_of(&mesh.positions);
        let (low_corner, high_corner) = (Vec3::from(low), Vec3::from(high));
        let diagonal = low_corner.distance(high_corner);
        let needed = views.as_ref().is_none_or(|views| views.cameras.len() < 5);
        let automatic = needed.then(|| framing::views(mesh));
        let sun = views.as_ref().and_then(|views| views.sun);
        let position = views.iter().chain(&automatic).map(|views| views.light).next().unwrap_or(high);
        let mut found = views.into_iter().chain(automatic).flat_map(|views| views.cameras);
        let to_middle = Vec3::from(position).distance(low_corner.midpoint(high_corner));
        let reach = to_middle.max(0.4 * diagonal).max(f32::MIN_POSITIVE);
        let fallback = Camera::looking_at(high, low, 60.0);
        Self {
            light: PointLight { position, color: [2.2, 2.1, 1.95], reach },
            sun: sun.map(|direction| DirectionalLight { direction, color: SUN_COLOR }),
            ambient: Ambient { above: [0.30, 0.31, 0.33], below: [0.22, 0.21, 0.20] },
            sky: sun.map_or_else(Sky::day, |sun_direction| Sky { sun_direction, ..Sky::day() }),
            cameras: std::array::from_fn(|_| found.next().unwrap_or(fallback)),
        }
    }

    /// A scene without textures, warnings or refractive triangles, for the caller to complete.
    pub fn into_scene(self, name: String, mesh: Mesh, materials: Vec<Material>) -> Scene {
        Scene {
            name,
            opaque_triangle_count: mesh.triangles.len() as u32,
            positions: mesh.positions,
            normals: mesh.normals,
            texcoords: mesh.texcoords,
            colors: mesh.colors,
            triangles: mesh.triangles,
            triangle_materials: mesh.triangle_materials,
            source_triangles: mesh.source_triangles,
            materials,
            textures: Vec::new(),
            normal_maps: Vec::new(),
            light: self.light,
            sun: self.sun,
            ambient: self.ambient,
            sky: self.sky,
            cameras: self.cameras,
            degenerate_triangle_count: 0,
            resize: 1.0,
            warnings: Vec::new(),
        }
    }
}
