//! A wooded valley around a lake, of as many triangles as are wished for: the world that needs no file.

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::tree;
use crate::app::loading::Stopped;
use crate::app::progress::Progress;
use crate::scene::mesh::Mesh;
use crate::scene::noise::{fractal, lattice};
use crate::scene::setting::Setting;
use crate::scene::{Ambient, Camera, DirectionalLight, Material, PointLight, Scene, Sky};

/// Half the side of the ground, in metres.
const HALF: f32 = 70.0;
/// Shares of the triangles that go into ground and water; trees have the rest.
const GROUND_SHARE: f32 = 0.36;
const WATER_SHARE: f32 = 0.04;
/// Places that are looked at for each tree before the valley counts as full.
const TRIES: u32 = 64;

const SAND: u32 = 0;
const GRASS: u32 = 1;
const GRASSES: u32 = 3;
const ROCK: u32 = 4;
const ROCKS: u32 = 2;
const SNOW: u32 = 6;
const WATER: u32 = 7;

/// The parts of the valley, and where the trees stand in it.
pub(crate) struct Valley {
    /// Ground and water, with the valley's light and cameras.
    pub(crate) ground: Scene,
    /// Kinds of trees around the origin, a metre high.
    pub(crate) trees: Vec<Scene>,
    /// Index of its kind, and place, of each tree.
    pub(crate) places: Vec<(usize, Affine3A)>,
}

impl Valley {
    /// A valley whose ground and kinds of trees have about `triangles` triangles in all, with `trees` trees, or as many as find
    /// room. The same everywhere.
    pub(crate) fn new(triangles: u32, trees: u32, progress: &mut Progress) -> Result<Self, Stopped> {
        progress.stage("making the valley", triangles.into());
        let budget = triangles as f32;
        let of_tree = (1.0 - GROUND_SHARE - WATER_SHARE) * budget / tree::KINDS.len() as f32;
        let mut mesh = Mesh::default();
        ground(&mut mesh, cells(GROUND_SHARE * budget), progress)?;
        water(&mut mesh, cells(WATER_SHARE * budget), progress)?;
        let mut done = mesh.triangles.len();
        let grow = |kind| {
            progress.go_on()?;
            let tree = tree_scene(kind, of_tree as u32);
            done += tree.triangles.len();
            progress.set(done as u64);
            Ok(tree)
        };
        let kinds = (0..tree::KINDS.len()).map(grow).collect::<Result<_, _>>()?;
        let ground = setting().into_scene("valley".to_owned(), mesh, materials());
        Ok(Self { ground, trees: kinds, places: places(trees) })
    }
}

fn tree_scene(kind: usize, triangles: u32) -> Scene {
    let tree::Tree { name, mesh, materials } = tree::grow(&tree::KINDS[kind], triangles, kind as u32);
    setting().into_scene(name, mesh, materials)
}

/// Cells along an edge of a square of two triangles a cell.
fn cells(triangles: f32) -> u32 {
    ((0.5 * triangles).sqrt() as u32).max(4)
}

/// Height of the ground; the lake's surface is at 0.
fn height(x: f32, z: f32) -> f32 {
    let from_middle = Vec2::new(x - 4.0, 0.9 * z + 6.0).length() / HALF;
    let rim = (from_middle * from_middle).min(1.6) * 26.0;
    let wide = fractal(0.021 * x + 7.3, 0.021 * z + 1.9, 4);
    let hills = fractal(0.075 * x + 3.1, 0.075 * z + 8.7, 4) - 0.46;
    let ridge = 1.0 - (2.0 * fractal(0.05 * x + 9.2, 0.05 * z + 4.4, 3) - 0.9).abs();
    let detail = fractal(0.55 * x, 0.55 * z, 4) - 0.46;
    let far = (1.6 * from_middle - 0.5).clamp(0.0, 1.0);
    -2.3 + rim * (0.25 + 1.1 * wide) + 4.2 * hills + far * far * 13.0 * ridge * ridge + 0.7 * detail
}

/// The unit normal of the ground.
fn slope(x: f32, z: f32) -> Vec3 {
    const STEP: f32 = 0.08;
    let along_x = height(x + STEP, z) - height(x - STEP, z);
    let along_z = height(x, z + STEP) - height(x, z - STEP);
    Vec3::new(-along_x, 2.0 * STEP, -along_z).normalize()
}

fn ground(mesh: &mut Mesh, cells: u32, progress: &mut Progress) -> Result<(), Stopped> {
    let material = |x: f32, z: f32| material_at(x, z, height(x, z), slope(x, z).y);
    let point = |x: f32, z: f32| (Vec3::new(x, height(x, z), z), slope(x, z));
    field(mesh, cells, HALF, point, material, progress)
}

/// The lake: flat, with ripples in its normals.
fn water(mesh: &mut Mesh, cells: u32, progress: &mut Progress) -> Result<(), Stopped> {
    let ripple = |x: f32, z: f32| fractal(0.8 * x + 5.0, 2.1 * z, 3);
    let point = |x: f32, z: f32| {
        let here = ripple(x, z);
        let [side, along] = [ripple(x + 0.1, z) - here, ripple(x, z + 0.1) - here];
        (Vec3::new(x, 0.0, z), Vec3::new(-0.10 * side, 1.0, -0.10 * along).normalize())
    };
    field(mesh, cells, 0.75 * HALF, point, |_, _| WATER, progress)
}

/// A square of `cells` x `cells` cells, from `-half` to `half`.
fn field(
    mesh: &mut Mesh,
    cells: u32,
    half: f32,
    point: impl Fn(f32, f32) -> (Vec3, Vec3),
    material: impl Fn(f32, f32) -> u32,
    progress: &mut Progress,
) -> Result<(), Stopped> {
    let at = |i: f32| half * (2.0 * i / cells as f32 - 1.0);
    let first = mesh.positions.len() as u32;
    // A row has two triangles a cell, which count half when their vertices are there.
    let before = mesh.triangles.len() as u64;
    let mut report = |rows: u32| {
        progress.set(before + u64::from(rows) * u64::from(cells));
        progress.go_on()
    };
    for row in 0..=cells {
        report(row)?;
        for column in 0..=cells {
            let (position, normal) = point(at(column as f32), at(row as f32));
            mesh.add_vertex(position.to_array(), normal.to_array(), [0.0; 2]);
        }
    }
    for (row, column) in (0..cells).flat_map(|row| (0..cells).map(move |column| (row, column))) {
        if column == 0 {
            report(cells + row)?;
        }
        let near = first + row * (cells + 1) + column;
        let far = near + cells + 1;
        let material = material(at(column as f32 + 0.5), at(row as f32 + 0.5));
        mesh.add_triangle([near, far, far + 1], material);
        mesh.add_triangle([near, far + 1, near + 1], material);
    }
    Ok(())
}

fn material_at(x: f32, z: f32, height: f32, upright: f32) -> u32 {
    let patches = fractal(0.35 * x + 2.0, 0.35 * z, 4) - 0.46;
    let speckle = lattice((9.0 * x) as i32, (9.0 * z) as i32, 4);
    match () {
        () if upright < 0.74 + 0.2 * patches => ROCK + (speckle * ROCKS as f32) as u32,
        () if height < 0.28 + 0.5 * patches => SAND,
        () if height > 19.0 + 9.0 * patches => SNOW,
        () => GRASS + ((0.5 + 1.1 * patches + 0.25 * speckle).clamp(0.0, 0.99) * GRASSES as f32) as u32,
    }
}

fn materials() -> Vec<Material> {
    let matte = Material::matte;
    let water = Material {
        specular: [0.7; 3],
        shininess: 300.0,
        reflectivity: 0.62,
        tint: [0.88, 0.94, 1.0],
        ..matte("water", [0.012, 0.045, 0.055])
    };
    vec![
        matte("sand", [0.52, 0.44, 0.30]),
        matte("grass", [0.10, 0.19, 0.035]),
        matte("meadow", [0.17, 0.25, 0.05]),
        matte("moss", [0.075, 0.13, 0.03]),
        matte("rock", [0.25, 0.23, 0.21]),
        matte("stone", [0.33, 0.30, 0.27]),
        matte("snow", [0.86, 0.88, 0.92]),
        water,
    ]
}

/// Positions of trees: on grass that is not steep, together in woods.
fn places(wanted: u32) -> Vec<(usize, Affine3A)> {
    let tries = 0..wanted.saturating_mul(TRIES);
    tries.filter_map(place).take(wanted as usize).collect()
}

fn place(number: u32) -> Option<(usize, Affine3A)> {
    let chance = |seed| lattice(number as i32, 17, seed);
    let [x, z] = [1, 2].map(|seed| 0.96 * HALF * (2.0 * chance(seed) - 1.0));
    let ground = height(x, z);
    let woods = fractal(0.06 * x + 4.0, 0.06 * z + 6.0, 3);
    let grows = (0.5..15.0).contains(&ground) && slope(x, z).y > 0.8 && woods > 0.36 + 0.2 * chance(3);
    if !grows {
        return None;
    }
    // Firs climb higher than other trees.
    let kind =
        if ground > 5.0 + 3.0 * chance(4) { 0 } else { (chance(5) * tree::KINDS.len() as f32) as usize };
    let size = tree::KINDS[kind].height * (0.7 + 0.6 * chance(6));
    let turn = Quat::from_rotation_y(std::f32::consts::TAU * chance(7));
    let at = Vec3::new(x, ground - 0.05, z);
    Some((kind, Affine3A::from_scale_rotation_translation(Vec3::splat(size), turn, at)))
}

/// A clear morning with the sun from the left.
fn setting() -> Setting {
    let sun_direction = Vec3::new(-0.72, 0.52, 0.28).normalize().to_array();
    let eye = |x: f32, above: f32, z: f32| [x, height(x, z).max(0.0) + above, z];
    Setting {
        light: PointLight { position: [0.0, 30.0, 0.0], color: [0.0; 3], reach: 1.0 },
        sun: Some(DirectionalLight { direction: sun_direction, color: [2.7, 2.3, 1.75] }),
        ambient: Ambient { above: [0.30, 0.37, 0.50], below: [0.15, 0.14, 0.10] },
        sky: Sky {
            zenith: [0.08, 0.22, 0.62],
            horizon: [0.72, 0.80, 0.90],
            ground: [0.30, 0.34, 0.36],
            sun_direction,
            sun_color: [14.0, 11.5, 8.5],
            clouds: 0.4,
        },
        cameras: [
            Camera::looking_at(eye(6.0, 3.4, 31.0), [1.0, 3.0, -12.0], 46.0),
            Camera::looking_at(eye(30.0, 2.6, 14.0), [-12.0, 3.0, -8.0], 50.0),
            Camera::looking_at([38.0, 34.0, 52.0], [0.0, 0.0, -6.0], 48.0),
            Camera::looking_at(eye(-24.0, 3.0, 10.0), [8.0, 2.0, -14.0], 50.0),
            Camera::looking_at(eye(4.0, 8.0, -52.0), [4.0, 1.0, 0.0], 55.0),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_valley_has_as_many_triangles_as_are_wished_for_and_is_the_same_every_time() {
        for wished in [3_000, 60_000] {
            let make = || Valley::new(wished, 40, &mut Progress::hidden()).unwrap();
            let valley = make();
            let trees = valley.trees.iter().map(|tree| tree.triangles.len());
            let count = valley.ground.triangles.len() + trees.sum::<usize>();
            assert!(count.abs_diff(wished as usize) < wished as usize / 8, "{count} instead of {wished}");
            let again = make();
            assert_eq!(valley.ground.positions, again.ground.positions);
            assert_eq!(valley.trees[1].triangles, again.trees[1].triangles);
            assert_eq!((valley.places.len(), valley.places), (40, again.places));
        }
    }

    #[test]
    fn trees_stand_on_dry_ground_and_all_kinds_grow() {
        let places = places(500);
        assert_eq!(places.len(), 500);
        for (_, place) in &places {
            let at = place.translation;
            assert!(at.y > 0.3 && (at.y - height(at.x, at.z)).abs() < 0.1, "{at}");
        }
        for kind in 0..tree::KINDS.len() {
            assert!(places.iter().any(|(found, _)| *found == kind), "{kind}");
        }
    }

    #[test]
    fn there_is_a_lake_and_there_are_mountains() {
        let heights: Vec<_> =
            (0..100).map(|i| height((i % 10) as f32 * 14.0 - 63.0, (i / 10) as f32 * 14.0 - 63.0)).collect();
        assert!(heights.iter().filter(|height| **height < 0.0).count() >= 5, "{heights:?}");
        assert!(heights.iter().any(|height| *height > 20.0), "{heights:?}");
    }
}
