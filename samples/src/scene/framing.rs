//! Five views of any mesh: around an object, or from inside a room.

use glam::Vec3;

use super::camera_file::Views;
use super::interior;
use super::mesh::Mesh;
use super::{Camera, bounds_of};

/// A side of the bounding box counts as a wall when this share of it is covered.
const WALL_COVER: f32 = 0.5;

/// Surfaces this close to a side of the bounding box, as a share of the box, belong to it.
const WALL_DEPTH: f32 = 0.06;

/// Light and five cameras for a mesh about which nothing is known.
pub(super) fn views(mesh: &Mesh) -> Views {
    let inside = is_interior(&mesh.positions, &mesh.triangles).then(|| interior::views(mesh)).flatten();
    inside.unwrap_or_else(|| around(mesh))
}

/// Four views from around an object and one from above; the first from the front and right, a little raised.
fn around(mesh: &Mesh) -> Views {
    const FOV: f32 = 40.0;
    let (low, high) = bounds_of(&mesh.positions);
    let (low, high) = (Vec3::from(low), Vec3::from(high));
    let center = 0.5 * (low + high);
    let radius = (0.5 * low.distance(high)).max(f32::MIN_POSITIVE);
    let directions = [(25.0, 15.0), (-50.0, 10.0), (115.0, 20.0), (205.0, 30.0), (35.0, 60.0)];
    let camera = |(azimuth, elevation): (f32, f32)| {
        let (sin_a, cos_a) = azimuth.to_radians().sin_cos();
        let (sin_e, cos_e) = elevation.to_radians().sin_cos();
        let outward = Vec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
        let far = Camera::looking_at((center + outward).to_array(), center.to_array(), FOV);
        let eye = center + fitting_distance(&far, 0.5 * (high - low)) * outward;
        Camera { eye: eye.to_array(), ..far }
    };
    let light = center + radius * Vec3::new(1.1, 1.8, 1.6);
    Views { light: light.to_array(), sun: None, cameras: directions.map(camera).into() }
}

/// Distance from the middle of a box with the given half size at which a camera sees all of it, in a picture
/// at least 4:3 wide, with some room at the edges.
fn fitting_distance(camera: &Camera, half_size: Vec3) -> f32 {
    let [right, up, forward] = camera.frame().map(Vec3::from);
    let usable = 0.88 * (0.5 * camera.vertical_fov_degrees).to_radians().tan();
    let corners =
        (0..8).map(|i| half_size * Vec3::select(glam::BVec3::from(bits(i)), Vec3::ONE, Vec3::NEG_ONE));
    let needed = corners.map(|corner| {
        let across = (corner.dot(right).abs() * 0.75).max(corner.dot(up).abs());
        across / usable - corner.dot(forward)
    });
    needed.fold(f32::MIN_POSITIVE, f32::max)
}

fn bits(i: u32) -> [bool; 3] {
    [0, 1, 2].map(|bit| i >> bit & 1 == 1)
}

/// True if the mesh surrounds its middle: at least four sides of the bounding box are covered by surfaces, and
/// these do not all face outwards as those of a solid block do.
pub(super) fn is_interior(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> bool {
    let (low, high) = bounds_of(positions);
    let size = Vec3::from(high) - Vec3::from(low);
    let (mut covered, mut outward, mut within) = ([0.0f32; 6], 0.0, 0.0);
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]));
        let area = 0.5 * (b - a).cross(c - a);
        match side_of(&[a, b, c], low.into(), high.into()) {
            Some(side) => {
                let facing = if side % 2 == 0 { -area[side / 2] } else { area[side / 2] };
                covered[side] += facing.abs();
                outward += facing.max(0.0);
            }
            None => within += area.length(),
        }
    }
    let side_area = |side: usize| size[(side / 2 + 1) % 3] * size[(side / 2 + 2) % 3];
    let wall_count = (0..6).filter(|&side| covered[side] >= WALL_COVER * side_area(side)).count();
    let all: f32 = covered.iter().sum();
    wall_count >= 4 && (outward < 0.8 * all || within > 0.5 * all)
}

/// The side of the box (-x +x -y +y -z +z) in whose neighbourhood all three corners lie.
fn side_of(corners: &[Vec3; 3], low: Vec3, high: Vec3) -> Option<usize> {
    let depth = WALL_DEPTH * (high - low);
    (0..6).find(|&side| {
        let axis = side / 2;
        corners.iter().all(|corner| match side % 2 {
            0 => corner[axis] <= low[axis] + depth[axis],
            _ => corner[axis] >= high[axis] - depth[axis],
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box from -1 to 1 whose faces look outwards or inwards, without the side +z if `open`.
    fn hollow(inwards: bool, open: bool) -> Mesh {
        let mut mesh = Mesh::default();
        for side in 0..if open { 5 } else { 6 } {
            let (axis, sign) = (side / 2, if side % 2 == 0 { -1.0 } else { 1.0 });
            let corner = |u: f32, v: f32| {
                let mut position = [0.0; 3];
                position[axis] = sign;
                position[(axis + 1) % 3] = u * sign;
                position[(axis + 2) % 3] = v;
                position
            };
            let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(u, v)| mesh.add_vertex(corner(u, v), [0.0, 1.0, 0.0], [0.0; 2]));
            let [first, second] = if inwards { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
            mesh.add_triangle(first, 0);
            mesh.add_triangle(second, 0);
        }
        mesh
    }

    fn sees_every_corner(camera: &Camera, mesh: &Mesh) -> bool {
        let clip = camera.clip_from_view(16.0 / 9.0, 0.01, 100.0) * camera.view_from_world();
        mesh.positions.iter().all(|&p| {
            let projected = clip.project_point3(p.into());
            projected.x.abs() <= 1.0 && projected.y.abs() <= 1.0 && (0.0..=1.0).contains(&projected.z)
        })
    }

    #[test]
    fn a_block_is_seen_whole_from_outside() {
        let block = hollow(false, false);
        assert!(!is_interior(&block.positions, &block.triangles));
        let views = views(&block);
        assert_eq!(views.cameras.len(), 5);
        for camera in &views.cameras {
            assert!(sees_every_corner(camera, &block), "{camera:?}");
        }
    }

    #[test]
    fn an_interior_is_seen_from_inside() {
        for open in [false, true] {
            let room = hollow(true, open);
            assert!(is_interior(&room.positions, &room.triangles));
            let views = views(&room);
            assert_eq!(views.cameras.len(), 5);
            let inside = |p: [f32; 3]| p.iter().all(|x| x.abs() < 1.0);
            assert!(inside(views.light), "{:?}", views.light);
            assert!(views.cameras.iter().all(|camera| inside(camera.eye)), "{:?}", views.cameras);
        }
    }
}
