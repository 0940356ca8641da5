//! Views from inside a room: where there is space to stand, looking where there is much to see.

use glam::{UVec3, Vec3};

use super::camera_file::Views;
use super::mesh::Mesh;
use super::{Camera, bounds_of};

/// Cells along the longest side of the grid.
const CELLS: f32 = 48.0;

/// Most steps of half a cell: more than there are along the diagonal of the grid.
const MOST_STEPS: u32 = 4 * CELLS as u32;

/// Vertical field of view of the cameras, in degrees.
const FOV: f32 = 65.0;

/// Directions that a standing place is tried in.
const HEADINGS: u32 = 12;

/// Light near the ceiling and five cameras; `None` when there is no place that is free and surrounded.
pub(super) fn views(mesh: &Mesh) -> Option<Views> {
    let grid = Grid::from_mesh(mesh);
    let mut shots = grid.shots();
    let mut chosen: Vec<Shot> = Vec::new();
    while chosen.len() < 5 {
        let next = best(&shots, &chosen, grid.high.distance(grid.low))?;
        chosen.push(shots.swap_remove(next));
    }
    let cameras = chosen.iter().map(Shot::camera).collect();
    Some(Views { light: grid.lamp().to_array(), sun: None, cameras })
}

/// A view that could be taken.
struct Shot {
    eye: Vec3,
    direction: Vec3,
    depth: f32,
    score: f32,
}

impl Shot {
    fn camera(&self) -> Camera {
        Camera::looking_at(self.eye.to_array(), (self.eye + self.depth * self.direction).to_array(), FOV)
    }
}

/// The best shot that shows something other than the chosen ones: from elsewhere or in another direction.
fn best(shots: &[Shot], chosen: &[Shot], diagonal: f32) -> Option<usize> {
    let novelty = |shot: &Shot| {
        let alike = chosen.iter().map(|other| {
            let near = (1.0 - shot.eye.distance(other.eye) / (0.4 * diagonal)).max(0.0);
            near * 0.4 + (0.5 + 0.5 * shot.direction.dot(other.direction)) * 0.5
        });
        shot.score * (1.0 - alike.fold(0.0, f32::max))
    };
    let ranked = shots.iter().map(novelty).enumerate();
    ranked.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
}

/// Cells of the bounding box that hold surfaces.
struct Grid {
    low: Vec3,
    high: Vec3,
    cell: f32,
    size: UVec3,
    filled: Vec<bool>,
    /// Number of triangles with their centre in each cell.
    detail: Vec<u32>,
}

impl Grid {
    fn from_mesh(mesh: &Mesh) -> Self {
        let (low, high) = bounds_of(&mesh.positions);
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let cell = ((high - low).max_element() / CELLS).max(f32::MIN_POSITIVE);
        let size = ((high - low) / cell).ceil().as_uvec3().max(UVec3::ONE) + 1;
        let cell_count = (size.x * size.y * size.z) as usize;
        let (filled, detail) = (vec![false; cell_count], vec![0; cell_count]);
        let mut grid = Self { low, high, cell, size, filled, detail };
        for triangle in &mesh.triangles {
            grid.fill(triangle.map(|v| Vec3::from(mesh.positions[v as usize])));
        }
        grid
    }

    /// Marks the cells of a triangle by points on it, at most half a cell apart.
    fn fill(&mut self, [a, b, c]: [Vec3; 3]) {
        if let Some(index) = self.index((a + b + c) / 3.0) {
            self.detail[index] += 1;
        }
        let longest = (b - a).length().max((c - a).length()).max((c - b).length());
        // The squares of very long edges are infinite.
        let steps = (2.0 * longest / self.cell).ceil().max(1.0).min(MOST_STEPS as f32) as u32;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (u, v) = (i as f32 / steps as f32, j as f32 / steps as f32);
                if let Some(index) = self.index(a + u * (b - a) + v * (c - a)) {
                    self.filled[index] = true;
                }
            }
        }
    }

    fn index(&self, point: Vec3) -> Option<usize> {
        let at = ((point - self.low) / self.cell).floor();
        if at.min_element() < 0.0 || at.cmpge(self.size.as_vec3()).any() {
            return None;
        }
        let at = at.as_uvec3();
        Some((at.x + self.size.x * (at.y + self.size.y * at.z)) as usize)
    }

    /// Distance from `from` along the unit vector `direction` to the next filled cell, and that cell; `None`
    /// outside.
    fn hit(&self, from: Vec3, direction: Vec3) -> Option<(f32, usize)> {
        let mut distance = 0.0;
        for _ in 0..MOST_STEPS {
            distance += 0.5 * self.cell;
            let index = self.index(from + distance * direction)?;
            if self.filled[index] {
                return Some((distance, index));
            }
        }
        None
    }

    /// True if `point` is free and has surfaces below and on all sides but one.
    fn is_inside(&self, point: Vec3) -> bool {
        let around = [Vec3::NEG_Y, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
        let is_free = self.index(point).is_some_and(|index| !self.filled[index]);
        is_free && around.iter().filter(|&&direction| self.hit(point, direction).is_some()).count() >= 4
    }

    /// Every sensible view, from places at eye height on a coarse lattice.
    fn shots(&self) -> Vec<Shot> {
        let size = self.high - self.low;
        let mut shots = Vec::new();
        for height in [0.32, 0.5] {
            for (i, k) in (1..16).flat_map(|i| (1..16).map(move |k| (i, k))) {
                let eye = self.low + size * Vec3::new(i as f32 / 16.0, height, k as f32 / 16.0);
                if self.is_inside(eye) {
                    shots.extend((0..HEADINGS).filter_map(|heading| self.shot(eye, heading)));
                }
            }
        }
        shots
    }

    /// The view from `eye` in one of the headings, looking a little down; `None` when something is too close.
    /// Wide views of many small triangles score high.
    fn shot(&self, eye: Vec3, heading: u32) -> Option<Shot> {
        let turn = |degrees: f32, rise: f32| {
            let angle = (heading as f32 * 360.0 / HEADINGS as f32 + degrees).to_radians();
            Vec3::new(angle.sin(), rise, angle.cos()).normalize()
        };
        let diagonal = self.high.distance(self.low);
        let rays = [-40.0, -20.0, 0.0, 20.0, 40.0]
            .into_iter()
            .flat_map(|degrees| [-0.45, -0.1, 0.25].map(|rise| turn(degrees, rise)));
        let (mut count, mut closeness, mut interest) = (0.0, 0.0, 0.0);
        for ray in rays {
            let (depth, detail) = match self.hit(eye, ray) {
                Some((depth, index)) => (depth, self.detail[index]),
                None => (0.15 * diagonal, 0),
            };
            if depth < 2.5 * self.cell {
                return None;
            }
            count += 1.0;
            closeness += 1.0 / depth;
            interest += (1.0 + detail as f32).log2().min(6.0) / 6.0;
        }
        let direction = turn(0.0, -0.12);
        let width = count / closeness;
        let depth = self.hit(eye, direction).map_or(width, |(depth, _)| depth);
        Some(Shot { eye, direction, depth, score: width * (0.2 + interest / count) })
    }

    /// The free place in the upper half that is farthest from everything, which lights the most.
    fn lamp(&self) -> Vec3 {
        let size = self.high - self.low;
        let lattice =
            (0..175).map(|i| [0.2 + 0.15 * (i % 5) as f32, 0.2 + 0.15 * (i / 5 % 5) as f32, (i / 25) as f32]);
        let places = lattice.map(|[x, z, level]| self.low + size * Vec3::new(x, 0.88 - 0.06 * level, z));
        let free = places.filter(|place| self.index(*place).is_some_and(|index| !self.filled[index]));
        let ranked = free.map(|place| (self.openness(place), place));
        let fallback = self.low + size * Vec3::new(0.5, 0.8, 0.5);
        ranked.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(fallback, |(_, place)| place)
    }

    /// Mean distance to surfaces around and below `place`; openings count little.
    fn openness(&self, place: Vec3) -> f32 {
        let setup = 0.1 * self.high.distance(self.low);
        let directions = (0..32).map(|i| {
            let (turn, drop) = ((i % 16) as f32 * std::f32::consts::TAU / 16.0, (i / 16) as f32);
            Vec3::new(turn.sin(), -0.2 - drop, turn.cos()).normalize()
        });
        directions.map(|direction| self.hit(place, direction).map_or(setup, |(depth, _)| depth)).sum::<f32>()
            / 32.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: Vec<[f32; 3]>) -> Mesh {
        let triangles =
            (0..positions.len() as u32 / 3).map(|first| [0, 1, 2].map(|v| 3 * first + v)).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn meshes_beyond_the_squares_of_floats_end() {
        for far in [1e18, 1e25, 1e38] {
            let corners = vec![[-far, 0.0, 0.0], [far, far, 0.0], [0.0, -far, far]];
            let grid = Grid::from_mesh(&mesh(corners.clone()));
            assert!(grid.filled.iter().filter(|filled| **filled).count() > 100, "{far}");
            let _ = views(&mesh(corners));
        }
    }

    #[test]
    fn rays_end_where_floats_have_no_place_for_the_next_cell() {
        let at = [4e6, 7e6, 5e6];
        for small in [0.0, 1e-30, 0.25] {
            let corners = vec![at, [at[0] + small, at[1], at[2]], [at[0], at[1] + small, at[2]]];
            let grid = Grid::from_mesh(&mesh(corners));
            let hit = grid.hit(Vec3::from(at), Vec3::NEG_Y);
            assert!(hit.is_none_or(|(distance, _)| distance.is_finite()), "{small}");
        }
    }
}
