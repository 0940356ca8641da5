//! Buildings: storeys of windows over shops, with roofs.

use glam::{Vec2, Vec3};

use super::facade::{Look, Style, Wall};
use super::random::Random;
use super::solid::Solid;
use super::surfaces::Surface;

/// Side of the square that a building stands on, in metres.
pub(super) const LOT: f32 = 24.0;
/// Height of the ground floor.
const SHOPS: f32 = 4.2;

/// The class of a building, by its height.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    /// Three to five floors under tiles or slate.
    House,
    /// Five to eight floors.
    Apartments,
    /// Eight to thirteen floors.
    Office,
    /// Eighteen to thirty-two floors, some in steps.
    Tower,
}

impl Class {
    /// The class of a kind of building, by its number.
    pub(super) fn of_kind(kind: usize) -> Self {
        [
            Self::Apartments,
            Self::House,
            Self::Office,
            Self::Apartments,
            Self::Tower,
            Self::House,
            Self::Apartments,
            Self::Office,
        ][kind % 8]
    }
}

/// A building on the middle of its lot, its front towards +z.
pub(super) fn building(kind: usize, seed: u64) -> Solid {
    let mut random = Random::new(seed, 0x1000 + kind as u64);
    let (class, mut solid) = (Class::of_kind(kind), Solid::default());
    let half = Vec2::new(random.within(10.6..0.5 * LOT - 0.02), random.within(9.0..11.2));
    // The front of all buildings is on one line.
    let middle = Vec2::new(0.0, 0.5 * LOT - half.y);
    let look = choose_look(class, &mut random);
    let (floors, storey) = match class {
        Class::House => (2 + random.below(3), 3.1),
        Class::Apartments => (4 + random.below(4), 3.2),
        Class::Office => (7 + random.below(6), 3.6),
        Class::Tower => (17 + random.below(15), 3.7),
    };
    let [mut low, mut high] = [middle - half, middle + half];
    ground_floor(&mut solid, [low, high], &look, &mut random);
    let mut height = SHOPS;
    for floor in 0..floors {
        // Towers step back twice.
        if class == Class::Tower && (floor == floors / 2 || floor == 4 * floors / 5) {
            roof_slab(&mut solid, [low, high], height, look.trim);
            (low, high) = (low + Vec2::splat(1.6), high - Vec2::splat(1.6));
        }
        for (side, wall) in Wall::around(low, high, height).iter().enumerate() {
            wall.storey(&mut solid, &look, storey, floor + side);
            if look.style != Style::Curtain && floor % 3 == 0 {
                wall.bar(&mut solid, look.trim, [0.0, -0.12, 0.0], [wall.length, 0.1, 0.12]);
            }
        }
        height += storey;
    }
    match class {
        Class::House => pitched_roof(&mut solid, [low, high], height, &mut random),
        _ => flat_roof(&mut solid, [low, high], height, &look, &mut random),
    }
    solid
}

fn choose_look(class: Class, random: &mut Random) -> Look {
    use Surface::{
        Brick, Bronze, Concrete, DarkBrick, Frame, Kerb, Limestone, Ochre, Plaster, Rose, Sandstone, Steel,
    };
    let light = [Limestone, Plaster, Kerb];
    match class {
        Class::House | Class::Apartments => Look {
            style: if class == Class::House {
                Style::Sash
            } else {
                random.entry([Style::Sash, Style::Balcony])
            },
            wall: random.entry([Brick, Plaster, Ochre, Rose, Sandstone, DarkBrick, Limestone]),
            trim: random.entry(light),
            frame: random.entry([Frame, Frame, Bronze]),
        },
        Class::Office => Look {
            style: random.entry([Style::Wide, Style::Wide, Style::Curtain]),
            wall: random.entry([Limestone, Sandstone, Concrete, Brick]),
            trim: random.entry(light),
            frame: random.entry([Bronze, Steel]),
        },
        Class::Tower => Look {
            style: random.entry([Style::Curtain, Style::Curtain, Style::Wide]),
            wall: random.entry([Concrete, Surface::Slate, Limestone]),
            trim: Concrete,
            frame: random.entry([Steel, Bronze]),
        },
    }
}

/// Shop windows, doors and awnings.
fn ground_floor(solid: &mut Solid, [low, high]: [Vec2; 2], look: &Look, random: &mut Random) {
    for wall in Wall::around(low, high, 0.0) {
        let count = (wall.length / 4.4).round().max(1.0) as usize;
        let bay = wall.length / count as f32;
        let door = random.below(count);
        for number in 0..count {
            let (from, to) = (bay * number as f32, bay * (number + 1) as f32);
            let opening = [Vec2::new(from + 0.45, 0.45), Vec2::new(to - 0.45, 3.0)];
            wall.panel(solid, look.trim, [Vec2::new(from, 3.0), Vec2::new(to, SHOPS)], 0.0);
            wall.bar(solid, look.trim, [from, 0.0, -0.3], [from + 0.45, 3.0, 0.0]);
            wall.bar(solid, look.trim, [to - 0.45, 0.0, -0.3], [to, 3.0, 0.0]);
            if number == door {
                let leaf = [Vec2::new(from + 0.45, 0.0), Vec2::new(to - 0.45, 3.0)];
                wall.panel(solid, Surface::Door, leaf, -0.25);
                wall.bar(
                    solid,
                    look.frame,
                    [0.5 * (from + to) - 0.03, 0.0, -0.25],
                    [0.5 * (from + to) + 0.03, 3.0, -0.2],
                );
                continue;
            }
            wall.panel(solid, Surface::Glass, opening, -0.25);
            wall.bar(solid, look.wall, [from + 0.45, 0.0, -0.3], [to - 0.45, 0.45, -0.05]);
            let middle = 0.5 * (from + to);
            wall.bar(solid, look.frame, [middle - 0.03, 0.45, -0.25], [middle + 0.03, 3.0, -0.18]);
            if random.chance(0.4) {
                wall.awning(solid, [from + 0.3, to - 0.3], [2.55, 3.15], 1.2);
            }
        }
        wall.bar(solid, look.trim, [-0.05, SHOPS - 0.35, 0.0], [wall.length + 0.05, SHOPS - 0.05, 0.18]);
    }
}

/// The roof of a storey that is larger than the one above.
fn roof_slab(solid: &mut Solid, [low, high]: [Vec2; 2], height: f32, trim: Surface) {
    solid.cuboid(Surface::Felt, [low.x, height - 0.3, low.y], [high.x, height, high.y]);
    for wall in Wall::around(low, high, height) {
        wall.bar(solid, trim, [-0.05, -0.3, -0.3], [wall.length + 0.05, 0.05, 0.08]);
    }
}

/// A parapet with what stands on roofs.
fn flat_roof(solid: &mut Solid, [low, high]: [Vec2; 2], height: f32, look: &Look, random: &mut Random) {
    roof_slab(solid, [low, high], height, look.trim);
    // The backs of parapets.
    for (a, b) in [
        ([low.x, low.y], [high.x, low.y + 0.3]),
        ([low.x, high.y - 0.3], [high.x, high.y]),
        ([low.x, low.y], [low.x + 0.3, high.y]),
        ([high.x - 0.3, low.y], [high.x, high.y]),
    ] {
        solid.cuboid(look.wall, [a[0], height, a[1]], [b[0], height + 0.9, b[1]]);
    }
    let size = high - low;
    let stairs = low + size * Vec2::new(random.within(0.2..0.5), random.within(0.2..0.5));
    solid.cuboid(look.wall, [stairs.x, height, stairs.y], [stairs.x + 4.5, height + 2.8, stairs.y + 3.2]);
    for _ in 0..4 + random.below(5) {
        let at = low + size * Vec2::new(random.within(0.1..0.8), random.within(0.1..0.8));
        air_conditioner(solid, at.extend(height), random);
    }
}

/// A box with a round fan on its top. `at` has x, z and the height.
fn air_conditioner(solid: &mut Solid, at: Vec3, random: &mut Random) {
    let (width, tall) = (random.within(1.2..2.4), random.within(0.8..1.4));
    let (low, top) = (Vec3::new(at.x, at.z, at.y), at.z + tall);
    solid.cuboid(Surface::Steel, low.to_array(), [low.x + width, top, low.z + 1.2]);
    let fan = Vec3::new(low.x + 0.5 * width, top, low.z + 0.6);
    solid.ring(Surface::Steel, [fan, fan + 0.2 * Vec3::Y], [0.5, 0.5], 20);
    solid.disc(Surface::Tyre, fan + 0.2 * Vec3::Y, Vec3::Y, 0.5, 20);
}

/// A hipped roof with rows of tiles, dormers and chimneys.
fn pitched_roof(solid: &mut Solid, [low, high]: [Vec2; 2], height: f32, random: &mut Random) {
    const OVERHANG: f32 = 0.45;
    let surface = random.entry([Surface::Tiles, Surface::Slate, Surface::Tiles]);
    let (low, high) = (low - Vec2::splat(OVERHANG), high + Vec2::splat(OVERHANG));
    let inset = 0.42 * (high - low).min_element();
    let rows = 22;
    let at = |row: usize, lift: f32| {
        let share = row as f32 / rows as f32;
        let [from, to] = [low + inset * share, high - inset * share];
        let y = height + 0.78 * inset * share + lift;
        [[from.x, to.y], [to.x, to.y], [to.x, from.y], [from.x, from.y]].map(|[x, z]| Vec3::new(x, y, z))
    };
    for row in 0..rows {
        // Each row of tiles lies on the one below.
        let [below, above] = [at(row, 0.06), at(row + 1, 0.0)];
        for side in 0..4 {
            let next = (side + 1) % 4;
            let corners = [below[side], below[next], above[side], above[next]];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
            solid.quad_with_normal(surface, corners, normal);
            let edge = [at(row, 0.0)[side], at(row, 0.0)[next], below[side], below[next]];
            let out = (edge[1] - edge[0]).cross(Vec3::Y).normalize_or(Vec3::X);
            solid.quad_with_normal(surface, edge, out);
        }
    }
    let [a, b, c, d] = at(rows, 0.0);
    solid.quad_with_normal(surface, [a, b, d, c], Vec3::Y);
    let ridge = height + 0.78 * inset;
    for _ in 0..2 + random.below(3) {
        let at = low + (high - low) * Vec2::new(random.within(0.25..0.75), random.within(0.3..0.7));
        solid.cuboid(Surface::DarkBrick, [at.x, height, at.y], [at.x + 0.9, ridge + 1.4, at.y + 0.7]);
        for number in 0..2 {
            let foot = Vec3::new(at.x + 0.25 + 0.4 * number as f32, ridge + 1.4, at.y + 0.35);
            solid.ring(Surface::Tiles, [foot, foot + 0.5 * Vec3::Y], [0.14, 0.11], 12);
        }
    }
    let wall = Wall::around(low, high, height)[0];
    for number in 0..3 {
        dormer(solid, &wall, surface, wall.length * (0.25 + 0.25 * number as f32), inset);
    }
}

/// A window with a small roof of its own, in the slope over a wall.
fn dormer(solid: &mut Solid, wall: &Wall, surface: Surface, x: f32, inset: f32) {
    let (back, front) = (-inset, -0.12 * inset);
    wall.bar(solid, Surface::Frame, [x - 0.8, 0.0, back], [x + 0.8, 0.1 * inset + 1.7, front]);
    let glass = [Vec2::new(x - 0.6, 0.1 * inset + 0.45), Vec2::new(x + 0.6, 0.1 * inset + 1.5)];
    wall.panel(solid, Surface::Glass, glass, front + 0.01);
    wall.bar(solid, Surface::Frame, [x - 0.03, glass[0].y, front], [x + 0.03, glass[1].y, front + 0.05]);
    wall.bar(solid, surface, [x - 1.0, 0.1 * inset + 1.7, back], [x + 1.0, 0.1 * inset + 1.85, front + 0.25]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buildings_stay_on_their_lots_and_differ() {
        let all: Vec<Solid> = (0..16).map(|kind| building(kind, 3)).collect();
        for solid in &all {
            let [low, high] = solid.bounds();
            // Awnings, cornices and balconies reach over the street.
            assert!(low.x > -0.5 * LOT - 1.5 && high.x < 0.5 * LOT + 1.5, "{low} {high}");
            assert!(low.z > -0.5 * LOT - 1.5 && high.z < 0.5 * LOT + 1.5, "{low} {high}");
            assert!(low.y >= -0.01 && high.y < 150.0);
            assert!((2_000..80_000).contains(&solid.triangle_count()), "{}", solid.triangle_count());
        }
        let mut counts: Vec<u64> = all.iter().map(Solid::triangle_count).collect();
        counts.sort_unstable();
        counts.dedup();
        assert!(counts.len() > 12);
    }
}
