//! Streets of scenes: each on a plot of its own, rooms without their ceilings.

use glam::{Affine3A, Quat, Vec2, Vec3};

use crate::scene::{Ambient, Camera, DirectionalLight, Material, Scene, Sky, painted_textures};

/// Side of a plot, and from one plot to the next, in metres.
const PLOT: f32 = 8.0;
const PITCH: f32 = 10.0;
/// Height, as a share of a room's, above which triangles are left out.
const OPEN_ABOVE: f32 = 0.5;
/// Share of the plot that what is no room takes.
const OBJECT_SHARE: f32 = 0.75;
/// Metres of ground that a picture of the paving covers.
const PAVING: f32 = 10.0;

/// Scenes, ground first, and where they stand.
pub(super) struct Street {
    pub(super) scenes: Vec<Scene>,
    pub(super) places: Vec<(usize, Affine3A)>,
}

impl Street {
    /// `copies` of each of the scenes, of which there is at least one.
    pub(super) fn new(scenes: Vec<Scene>, copies: u32) -> Self {
        let kinds = scenes.len();
        let count = kinds * copies as usize;
        let columns = (count as f32).sqrt().ceil() as usize;
        let rows = count.div_ceil(columns);
        let mut places = vec![(0, Affine3A::IDENTITY)];
        places.extend((0..count).map(|plot| (1 + plot % kinds, place(plot, plot / kinds, [columns, rows]))));
        let half = 0.5 * PITCH * Vec2::new(columns as f32, rows as f32);
        let fitted = scenes.into_iter().map(fitted_scene);
        Self { scenes: std::iter::once(ground(half)).chain(fitted).collect(), places }
    }
}

/// Transform of the scene on a plot; each copy of a scene is turned to the next side.
fn place(plot: usize, copy: usize, [columns, rows]: [usize; 2]) -> Affine3A {
    let at = |index: usize, count: usize| PITCH * (index as f32 - 0.5 * (count as f32 - 1.0));
    let turn = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2 * (copy % 4) as f32);
    let to = Vec3::new(at(plot % columns, columns), 0.0, at(plot / columns, rows));
    Affine3A::from_rotation_translation(turn, to)
}

/// The scene on the middle of a plot, opened above where it is a room.
fn fitted_scene(mut scene: Scene) -> Scene {
    let is_interior = scene.is_interior();
    if is_interior {
        open(&mut scene);
    }
    let (low, high) = scene.bounds();
    let (low, high) = (Vec3::from(low), Vec3::from(high));
    let size = high - low;
    let side = if is_interior { PLOT } else { OBJECT_SHARE * PLOT };
    let scale = side / size.x.max(size.z).max(0.8 * size.y).max(f32::MIN_POSITIVE);
    let foot = Vec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    for position in &mut scene.positions {
        *position = (scale * (Vec3::from(*position) - foot) + 0.01 * Vec3::Y).to_array();
    }
    scene
}

/// Leaves out the triangles that lie above the height at which rooms are opened.
fn open(scene: &mut Scene) {
    let (low, high) = scene.bounds();
    let top = low[1] + OPEN_ABOVE * (high[1] - low[1]);
    let stays =
        |triangle: &[u32; 3]| triangle.iter().any(|vertex| scene.positions[*vertex as usize][1] < top);
    let kept: Vec<usize> = (0..scene.triangles.len()).filter(|&i| stays(&scene.triangles[i])).collect();
    let opaque = kept.iter().filter(|&&i| i < scene.opaque_triangle_count as usize).count();
    if opaque == 0 {
        return;
    }
    scene.opaque_triangle_count = opaque as u32;
    scene.triangles = kept.iter().map(|&i| scene.triangles[i]).collect();
    scene.triangle_materials = kept.iter().map(|&i| scene.triangle_materials[i]).collect();
    scene.source_triangles = kept.iter().map(|&i| scene.source_triangles[i]).collect();
}

/// The paved ground, with the world's light and cameras.
fn ground(half: Vec2) -> Scene {
    let mut textures = painted_textures();
    textures.truncate(1);
    let material = Material { albedo_texture: Some(0), ..Material::matte("paving", [0.85; 3]) };
    let edge = half + Vec2::splat(60.0);
    let corners =
        [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]].map(|corner| edge * Vec2::from(corner));
    let sun_direction = Vec3::new(-0.45, 0.78, 0.44).normalize().to_array();
    Scene {
        name: "street".to_owned(),
        positions: corners.map(|corner| [corner.x, 0.0, corner.y]).to_vec(),
        normals: vec![[0.0, 1.0, 0.0]; 4],
        texcoords: corners.map(|corner| (corner / PAVING).to_array()).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        opaque_triangle_count: 2,
        triangle_materials: vec![0; 2],
        source_triangles: vec![0, 1],
        materials: vec![material],
        textures,
        sun: Some(DirectionalLight { direction: sun_direction, color: [2.3, 2.05, 1.7] }),
        ambient: Ambient { above: [0.42, 0.46, 0.54], below: [0.30, 0.27, 0.24] },
        sky: Sky { sun_direction, ..Sky::day() },
        cameras: cameras(half),
        ..Scene::empty()
    }
}

/// Returns cameras above a corner, along a street, and above the middle.
fn cameras(half: Vec2) -> [Camera; 5] {
    let far = 0.5 * (half.x + half.y) + 1.0;
    let at = |x: f32, y: f32, z: f32| [x, y, z];
    [
        Camera::looking_at(at(-0.6 * far, 1.55 * far, 1.4 * far), at(0.0, 0.0, 0.06 * far), 38.0),
        Camera::looking_at(at(0.5 * PITCH, 3.2, half.y + 2.0), at(0.0, 0.5, 0.0), 50.0),
        Camera::looking_at(at(1.2 * far, 0.7 * far, 0.8 * far), at(0.0, 0.0, 0.0), 42.0),
        Camera::looking_at(at(0.1, 1.9 * far, 0.4 * far), at(0.0, 0.0, 0.0), 50.0),
        Camera::looking_at(at(-half.x - 1.0, 4.5, 0.5 * PITCH), at(0.0, 0.0, -1.0), 50.0),
    ]
}
