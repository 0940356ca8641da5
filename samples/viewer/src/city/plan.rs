//! Places of all objects of a city: a grid of blocks with eight buildings each, parks, and streets.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec2, Vec3};

use super::CityConfig;
use super::buildings::{Class, LOT, building};
use super::random::Random;
use super::solid::Solid;
use super::street::{self, BLOCK, KERB, PAVEMENT, PITCH, STREET};
use super::trees;

/// Meshes, where they stand, and cameras.
pub(super) struct Plan {
    pub(super) kinds: Vec<Kind>,
    pub(super) views: Vec<View>,
}

/// A mesh and its places.
pub(super) struct Kind {
    pub(super) name: String,
    pub(super) solid: Solid,
    pub(super) places: Vec<Place>,
}

/// A place: where, and the angle around the vertical in radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) position: Vec3,
    pub(super) turn: f32,
}

/// A camera.
pub(super) struct View {
    pub(super) name: &'static str,
    pub(super) eye: Vec3,
    pub(super) target: Vec3,
    /// Vertical field of view in radians.
    pub(super) fov: f32,
}

impl Place {
    pub(super) fn rotation(&self) -> Quat {
        Quat::from_rotation_y(self.turn)
    }
}

/// Numbers of the kinds, by what they are.
struct Kinds {
    buildings: usize,
    building_count: usize,
    trees: usize,
    cars: usize,
    lamp: usize,
    bench: usize,
    blocks: [usize; 2],
    markings: usize,
}

struct Planner {
    kinds: Vec<Kind>,
    of: Kinds,
    /// Metres from the middle to the edge.
    half: f32,
    random: Random,
}

/// Plans a city around the origin.
pub(super) fn plan(config: &CityConfig) -> Plan {
    let half = 0.5 * PITCH * config.blocks as f32;
    let (kinds, of) = make_kinds(config, half);
    let mut planner = Planner { kinds, of, half, random: Random::new(config.seed, 0) };
    for (row, column) in
        (0..config.blocks).flat_map(|row| (0..config.blocks).map(move |column| (row, column)))
    {
        let at = |number: u32| (number as f32 + 0.5) * PITCH - half;
        planner.block(Vec2::new(at(column), at(row)), row + column == 1);
    }
    for line in 0..=config.blocks {
        planner.street(line as f32 * PITCH - half, config.blocks);
    }
    planner.kinds.retain(|kind| !kind.places.is_empty());
    Plan { kinds: planner.kinds, views: views(config, half) }
}

fn make_kinds(config: &CityConfig, half: f32) -> (Vec<Kind>, Kinds) {
    let mut kinds: Vec<Kind> = Vec::new();
    let mut add = |name: String, solid: Solid| {
        kinds.push(Kind { name, solid, places: Vec::new() });
        kinds.len() - 1
    };
    let ground = add("ground".into(), street::ground(2.0 * half));
    let of = Kinds {
        blocks: [false, true]
            .map(|is_park| add(if is_park { "park" } else { "block" }.into(), street::block(is_park))),
        markings: add("markings".into(), street::markings()),
        lamp: add("lamp".into(), street::lamp()),
        bench: add("bench".into(), street::bench()),
        trees: ground + 6,
        cars: ground + 6 + trees::KINDS,
        buildings: ground + 6 + trees::KINDS + street::CARS,
        building_count: config.kinds as usize,
    };
    for kind in 0..trees::KINDS {
        add(format!("tree {}", kind + 1), trees::tree(kind, config.seed));
    }
    for kind in 0..street::CARS {
        add(format!("car {}", kind + 1), street::car(kind, config.seed));
    }
    for kind in 0..config.kinds as usize {
        add(format!("building {}", kind + 1), building(kind, config.seed));
    }
    kinds[ground].places.push(Place { position: Vec3::ZERO, turn: 0.0 });
    (kinds, of)
}

impl Planner {
    fn place(&mut self, kind: usize, [x, y, z]: [f32; 3], turn: f32) {
        self.kinds[kind].places.push(Place { position: Vec3::new(x, y, z), turn });
    }

    fn block(&mut self, middle: Vec2, is_always_park: bool) {
        let is_park = self.random.chance(0.12) || is_always_park;
        self.place(self.of.blocks[usize::from(is_park)], [middle.x, 0.0, middle.y], 0.0);
        if is_park {
            self.park(middle)
        } else {
            self.houses(middle)
        }
        for side in 0..4 {
            self.pavement(middle, FRAC_PI_2 * side as f32);
        }
    }

    /// A building on each of the eight lots along the streets, and trees in the court.
    fn houses(&mut self, middle: Vec2) {
        for (column, row) in (0..3).flat_map(|row| (0..3).map(move |column| (column, row))) {
            let step = Vec2::new(column as f32 - 1.0, row as f32 - 1.0);
            if step == Vec2::ZERO {
                continue;
            }
            let across = step.x != 0.0 && (step.y == 0.0 || self.random.chance(0.5));
            let turn = match (across, step.x > 0.0, step.y > 0.0) {
                (true, true, _) => FRAC_PI_2,
                (true, false, _) => -FRAC_PI_2,
                (false, _, true) => 0.0,
                (false, _, false) => PI,
            };
            let at = middle + LOT * step;
            let kind = self.building(at);
            self.place(kind, [at.x, KERB, at.y], turn);
        }
        for _ in 0..3 {
            let at = middle + Vec2::new(self.random.within(-8.0..8.0), self.random.within(-8.0..8.0));
            self.tree(at);
        }
    }

    /// Towers stand in the middle of the city, houses at its edge.
    fn building(&mut self, at: Vec2) -> usize {
        let share = at.abs().max_element() / self.half.max(300.0) + self.random.within(-0.2..0.2);
        let class = match share {
            share if share < 0.22 => Class::Tower,
            share if share < 0.42 => Class::Office,
            share if share < 0.72 => Class::Apartments,
            _ => Class::House,
        };
        let start = self.random.below(self.of.building_count);
        let all = (0..self.of.building_count).map(|step| (start + step) % self.of.building_count);
        let mut alike = all.filter(|kind| Class::of_kind(*kind) == class);
        self.of.buildings + alike.next().unwrap_or(start)
    }

    fn tree(&mut self, at: Vec2) {
        let (kind, turn) = (self.random.below(trees::KINDS), self.random.within(0.0..TAU));
        self.place(self.of.trees + kind, [at.x, KERB, at.y], turn);
    }

    fn park(&mut self, middle: Vec2) {
        let inner = 0.5 * BLOCK - PAVEMENT;
        for _ in 0..80 {
            let at = Vec2::new(self.random.within(-inner..inner), self.random.within(-inner..inner));
            let is_free = at.abs().min_element() > 4.0 && at.length() > 12.0;
            if is_free {
                self.tree(middle + at);
            }
        }
        for number in 0..8 {
            let angle = FRAC_PI_2 * (number / 2) as f32 + 0.35 + 0.87 * (number % 2) as f32;
            let at = middle + 9.6 * Vec2::new(angle.sin(), angle.cos());
            self.place(self.of.bench, [at.x, KERB + 0.03, at.y], angle + PI);
        }
    }

    /// Trees, lamps and parked cars along one side of a block.
    fn pavement(&mut self, middle: Vec2, turn: f32) {
        let out = Vec2::new(turn.sin(), turn.cos());
        let along = Vec2::new(out.y, -out.x);
        let edge = 0.5 * BLOCK;
        for number in 0..6 {
            let at = middle + along * (12.0 * number as f32 - 30.0) + out * (edge - 1.4);
            if self.random.chance(0.62) {
                self.tree(at);
            }
        }
        for number in 0..3 {
            let at = middle + along * (24.0 * number as f32 - 24.0) + out * (edge - 0.8);
            self.place(self.of.lamp, [at.x, KERB, at.y], turn);
        }
        for number in 0..11 {
            let at = middle + along * (6.2 * number as f32 - 31.0) + out * (edge + 1.2);
            if self.random.chance(0.33) {
                let kind = self.of.cars + self.random.below(street::CARS);
                let shift = along * self.random.within(-0.4..0.4);
                self.place(kind, [at.x + shift.x, 0.0, at.y + shift.y], turn);
            }
        }
        if self.random.chance(0.5) {
            let at = middle + along * self.random.within(-20.0..20.0) + out * (edge - PAVEMENT + 0.8);
            self.place(self.of.bench, [at.x, KERB, at.y], turn);
        }
    }

    /// Markings and traffic of the two streets at a distance from the middle, one along each axis.
    fn street(&mut self, offset: f32, blocks: u32) {
        for number in 0..blocks {
            let along = (number as f32 + 0.5) * PITCH - self.half;
            self.place(self.of.markings, [along, 0.0, offset], 0.0);
            self.place(self.of.markings, [offset, 0.0, along], FRAC_PI_2);
            for lane in [-1.0, 1.0] {
                for is_along_z in [false, true] {
                    if !self.random.chance(0.55) {
                        continue;
                    }
                    let at = along + self.random.within(-30.0..30.0);
                    let kind = self.of.cars + self.random.below(street::CARS);
                    let turn = if lane > 0.0 { 0.0 } else { PI };
                    let beside = offset + lane * (0.25 * STREET - 1.1);
                    match is_along_z {
                        false => self.place(kind, [at, 0.0, beside], turn),
                        true => self.place(kind, [beside, 0.0, at], turn + FRAC_PI_2),
                    }
                }
            }
        }
    }
}

/// From a sunny street, from a roof, and from above all.
fn views(config: &CityConfig, half: f32) -> Vec<View> {
    let line = |number: u32| number as f32 * PITCH - half;
    let middle = line(config.blocks / 2);
    let street = line(config.blocks / 2 + config.blocks / 5);
    let eye = Vec3::new(-0.72 * half, 1.75, street + 3.4);
    vec![
        View { name: "street", eye, target: eye + Vec3::new(80.0, 9.0, -17.0), fov: 1.0 },
        View {
            name: "roofs",
            eye: Vec3::new(middle - 190.0, 70.0, middle + 190.0).clamp(Vec3::splat(-half), Vec3::splat(half)),
            target: Vec3::new(middle + 40.0, 25.0, middle - 40.0),
            fov: 0.85,
        },
        View {
            name: "above",
            eye: Vec3::new(-0.35 * half, 0.28 * half + 80.0, 1.0 * half),
            target: Vec3::new(0.0, 0.0, -0.05 * half),
            fov: 0.75,
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_counter_clockwise_seen_from_where_their_normals_point() {
        let plan = plan(&CityConfig { blocks: 4, kinds: 16, seed: 2, texture_size: 0 });
        assert!(plan.kinds.len() > 30);
        for kind in &plan.kinds {
            for (surface, part) in kind.solid.parts() {
                let turned = part.indices.chunks_exact(3).filter(|corners| {
                    let [a, b, c] = [0, 1, 2].map(|corner| part.positions[corners[corner] as usize]);
                    (b - a).cross(c - a).dot(part.normals[corners[0] as usize]) < 0.0
                });
                assert_eq!(turned.count(), 0, "{} {surface:?}", kind.name);
            }
        }
    }

    #[test]
    fn nothing_but_traffic_stands_on_streets_and_towers_are_in_the_middle() {
        let plan = plan(&CityConfig { blocks: 6, kinds: 16, seed: 2, texture_size: 0 });
        let half = 3.0 * PITCH;
        let mut heights = [Vec::new(), Vec::new()];
        for kind in plan.kinds.iter().filter(|kind| kind.name.starts_with("building")) {
            let height = kind.solid.bounds()[1].y;
            for place in &kind.places {
                let offset = [place.position.x, place.position.z]
                    .map(|at| (at + half).rem_euclid(PITCH) - 0.5 * PITCH);
                assert!(offset.iter().all(|offset| offset.abs() < LOT + 0.1), "{} {offset:?}", kind.name);
                let is_outer = place.position.x.abs().max(place.position.z.abs()) > 0.6 * half;
                heights[usize::from(is_outer)].push(height);
            }
        }
        let mean = |heights: &[f32]| heights.iter().sum::<f32>() / heights.len() as f32;
        assert!(mean(&heights[0]) > 1.5 * mean(&heights[1]));
    }
}
