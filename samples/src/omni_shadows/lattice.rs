//! The lattice around the lamp: pentagons and hexagons on a sphere, of bars.

use glam::Vec3;

use crate::shapes::Mesh;

/// Cuts of an edge of the icosahedron that the lattice is made from.
const FREQUENCY: usize = 3;

/// Bars of `width` times `depth` on a sphere of `radius` around the origin. Turning it by a fifth of a turn about y changes
/// nothing.
pub(super) fn lattice(radius: f32, width: f32, depth: f32) -> Mesh {
    let cells = triangles();
    let mut mesh = Mesh::default();
    for (number, cell) in cells.iter().enumerate() {
        for other in &cells[number + 1..] {
            if are_neighbours(cell, other) {
                let [from, to] = [middle(cell), middle(other)].map(|at| radius * at);
                mesh = bar(mesh, from, to, [width, depth]);
            }
        }
    }
    mesh
}

/// Corners on the unit sphere, exact enough to be compared.
type Triangle = [Vec3; 3];

/// An icosahedron with corners on the y axis, each of its triangles cut into smaller ones.
fn triangles() -> Vec<Triangle> {
    let mut all = Vec::new();
    for corners in icosahedron() {
        let at = |i: usize, j: usize| {
            let weights = [FREQUENCY - i - j, i, j].map(|weight| weight as f32);
            (0..3).map(|corner| weights[corner] * corners[corner]).sum::<Vec3>().normalize()
        };
        for (i, j) in (0..FREQUENCY).flat_map(|i| (0..FREQUENCY - i).map(move |j| (i, j))) {
            all.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 2 <= FREQUENCY {
                all.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    all
}

fn icosahedron() -> Vec<Triangle> {
    let ring = |height: f32, number: usize, turn: f32| {
        let angle = (number as f32 + turn) * std::f32::consts::TAU / 5.0;
        Vec3::new(angle.cos(), 0.0, angle.sin()) * (1.0 - height * height).sqrt() + Vec3::Y * height
    };
    let height = 1.0 / 5.0_f32.sqrt();
    let mut all = Vec::new();
    for number in 0..5 {
        let [upper, next_upper] = [0, 1].map(|step| ring(height, number + step, 0.0));
        let [lower, next_lower] = [0, 1].map(|step| ring(-height, number + step, 0.5));
        all.push([Vec3::Y, upper, next_upper]);
        all.push([upper, lower, next_upper]);
        all.push([next_upper, lower, next_lower]);
        all.push([Vec3::NEG_Y, next_lower, lower]);
    }
    all
}

fn middle(cell: &Triangle) -> Vec3 {
    cell.iter().sum::<Vec3>().normalize()
}

fn are_neighbours(one: &Triangle, other: &Triangle) -> bool {
    let is_shared = |corner: &&Vec3| other.iter().any(|known| known.distance_squared(**corner) < 1e-6);
    one.iter().filter(is_shared).count() == 2
}

/// A bar between two points at one distance from the origin, with its ends beyond them by half its width.
fn bar(mesh: Mesh, from: Vec3, to: Vec3, [width, depth]: [f32; 2]) -> Mesh {
    let along = to - from + width * (to - from).normalize();
    let out = depth * (from + to).normalize();
    let across = width * out.cross(along).normalize();
    let corner = from - 0.5 * width * (to - from).normalize() - 0.5 * (across + out);
    mesh.parallelepiped(corner, [out, along, across], 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pentagons_and_hexagons_close_the_sphere() {
        let cells = triangles();
        assert_eq!(cells.len(), 20 * FREQUENCY * FREQUENCY);
        for cell in &cells {
            let count = cells.iter().filter(|other| are_neighbours(cell, other)).count();
            assert_eq!(count, 3, "three bars meet in {}", middle(cell));
        }
    }

    #[test]
    fn bars_are_closed_and_near_the_sphere() {
        let mesh = lattice(2.0, 0.1, 0.2);
        assert_eq!(mesh.triangles.len(), 30 * FREQUENCY * FREQUENCY * 12);
        assert!(mesh.vertices.iter().all(|vertex| (1.7..2.2).contains(&vertex.position.length())));
    }

    #[test]
    fn a_fifth_of_a_turn_changes_nothing() {
        let turn = glam::Quat::from_rotation_y(std::f32::consts::TAU / 5.0);
        let middles: Vec<_> = triangles().iter().map(middle).collect();
        for at in &middles {
            assert!(middles.iter().any(|other| other.distance(turn * *at) < 1e-3), "{at}");
        }
    }
}
