//! Walls with windows in them.

use glam::{Vec2, Vec3};

use super::solid::Solid;
use super::surfaces::Surface;

/// Depth of windows behind the wall.
const REVEAL: f32 = 0.22;

/// A vertical plane that parts of a building are put on: x goes along it, y up, z out of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wall {
    corner: Vec3,
    along: Vec3,
    out: Vec3,
    /// Extent of x.
    pub(super) length: f32,
}

/// The style of the windows in a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    /// Upright windows, each with a cross of bars and a sill.
    Sash,
    /// Wide windows with three upright bars.
    Wide,
    /// Upright windows, some with a balcony.
    Balcony,
    /// Glass from edge to edge, with fins of metal.
    Curtain,
}

/// The materials of a facade.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look {
    pub(super) style: Style,
    pub(super) wall: Surface,
    pub(super) trim: Surface,
    pub(super) frame: Surface,
}

/// The lowest and the highest corner of a rectangle on a wall.
type Area = [Vec2; 2];

impl Wall {
    /// The four walls around the rectangle from `low` to `high` in x and z, at a height.
    pub(super) fn around(low: Vec2, high: Vec2, height: f32) -> [Self; 4] {
        let wall = |x: f32, z: f32, along: Vec3, length: f32| Self {
            corner: Vec3::new(x, height, z),
            along,
            out: along.cross(Vec3::Y),
            length,
        };
        let size = high - low;
        [
            wall(low.x, high.y, Vec3::X, size.x),
            wall(high.x, high.y, Vec3::NEG_Z, size.y),
            wall(high.x, low.y, Vec3::NEG_X, size.x),
            wall(low.x, low.y, Vec3::Z, size.y),
        ]
    }

    fn at(&self, x: f32, y: f32, z: f32) -> Vec3 {
        self.corner + x * self.along + y * Vec3::Y + z * self.out
    }

    /// A rectangle at a distance before the wall.
    pub(super) fn panel(&self, solid: &mut Solid, surface: Surface, [low, high]: Area, z: f32) {
        let size = high - low;
        solid.quad(surface, self.at(low.x, low.y, z), size.x * self.along, size.y * Vec3::Y);
    }

    /// A box before the wall, without its back.
    pub(super) fn bar(&self, solid: &mut Solid, surface: Surface, low: [f32; 3], high: [f32; 3]) {
        let size = Vec3::from(high) - Vec3::from(low);
        let (x, y, z) = (size.x * self.along, size.y * Vec3::Y, size.z * self.out);
        let corner = self.at(low[0], low[1], low[2]);
        solid.quad(surface, corner + z, x, y);
        solid.quad(surface, corner, z, y);
        solid.quad(surface, corner + x, y, z);
        solid.quad(surface, corner + y, z, x);
        solid.quad(surface, corner, x, z);
    }

    /// A slanted rectangle, its lower edge out by `reach`: an awning.
    pub(super) fn awning(&self, solid: &mut Solid, [from, to]: [f32; 2], [low, high]: [f32; 2], reach: f32) {
        let (edge, slope) = ((to - from) * self.along, self.at(0.0, high, 0.0) - self.at(0.0, low, reach));
        solid.quad(Surface::Awning, self.at(from, low, reach), edge, slope);
        self.bar(solid, Surface::Awning, [from, low - 0.18, reach - 0.02], [to, low, reach]);
    }

    /// A storey of windows, evenly spaced. `seed` chooses which have balconies.
    pub(super) fn storey(&self, solid: &mut Solid, look: &Look, height: f32, seed: usize) {
        let width = match look.style {
            Style::Sash => 2.3,
            Style::Balcony => 3.1,
            Style::Wide => 3.6,
            Style::Curtain => 1.5,
        };
        let count = (self.length / width).round().max(1.0) as usize;
        let bay = self.length / count as f32;
        for number in 0..count {
            let area = [Vec2::new(bay * number as f32, 0.0), Vec2::new(bay * (number + 1) as f32, height)];
            match look.style {
                Style::Curtain => self.curtain(solid, look, area),
                style => {
                    let opening = self.opening(solid, look, area);
                    self.bars(solid, look, opening);
                    if style == Style::Balcony && !(number * 7 + seed * 3).is_multiple_of(3) {
                        self.balcony(solid, look, area);
                    }
                }
            }
        }
    }

    /// The wall of a bay around its opening, the reveal, and the glass. Returns the opening.
    fn opening(&self, solid: &mut Solid, look: &Look, [low, high]: Area) -> Area {
        let size = high - low;
        let [left, bottom, top] = match look.style {
            Style::Wide => [0.10, 0.28, 0.86],
            Style::Balcony => [0.22, 0.04, 0.80],
            _ => [0.24, 0.27, 0.84],
        };
        let from = low + size * Vec2::new(left, bottom);
        let to = low + size * Vec2::new(1.0 - left, top);
        for area in [
            [low, Vec2::new(from.x, high.y)],
            [Vec2::new(to.x, low.y), high],
            [Vec2::new(from.x, low.y), Vec2::new(to.x, from.y)],
            [Vec2::new(from.x, to.y), Vec2::new(to.x, high.y)],
        ] {
            self.panel(solid, look.wall, area, 0.0);
        }
        self.reveal(solid, look.trim, [from, to]);
        self.panel(solid, Surface::Glass, [from, to], -REVEAL);
        [from, to]
    }

    /// The four sides of an opening.
    fn reveal(&self, solid: &mut Solid, surface: Surface, [from, to]: Area) {
        let (width, height) = ((to.x - from.x) * self.along, (to.y - from.y) * Vec3::Y);
        let depth = REVEAL * self.out;
        let [low, high] = [self.at(from.x, from.y, -REVEAL), self.at(to.x, to.y, -REVEAL)];
        solid.quad(surface, low, depth, width);
        solid.quad(surface, low, height, depth);
        solid.quad(surface, high, depth, -width);
        solid.quad(surface, high, -height, depth);
    }

    /// The frame and the bars of a window, and its sill.
    fn bars(&self, solid: &mut Solid, look: &Look, [from, to]: Area) {
        const BAR: f32 = 0.035;
        let (back, front) = (-REVEAL, -REVEAL + 0.06);
        let upright = |solid: &mut Solid, x: f32| {
            self.bar(solid, look.frame, [x - BAR, from.y, back], [x + BAR, to.y, front]);
        };
        let count = if look.style == Style::Wide { 3 } else { 1 };
        for number in 0..=count + 1 {
            let share = number as f32 / (count + 1) as f32;
            upright(solid, (from.x + BAR) + share * (to.x - from.x - 2.0 * BAR));
        }
        for y in [from.y + BAR, from.y + 0.62 * (to.y - from.y), to.y - BAR] {
            self.bar(solid, look.frame, [from.x, y - BAR, back], [to.x, y + BAR, front]);
        }
        if look.style != Style::Balcony {
            self.bar(solid, look.trim, [from.x - 0.1, from.y - 0.1, -REVEAL], [to.x + 0.1, from.y, 0.09]);
            self.bar(solid, look.trim, [from.x - 0.08, to.y, 0.0], [to.x + 0.08, to.y + 0.16, 0.05]);
        }
    }

    /// A slab with a railing.
    fn balcony(&self, solid: &mut Solid, look: &Look, [low, high]: Area) {
        let (from, to, reach) = (low.x + 0.3, high.x - 0.3, 1.15);
        self.bar(solid, look.trim, [from, low.y - 0.14, 0.0], [to, low.y + 0.02, reach]);
        self.bar(solid, look.frame, [from, low.y + 1.0, reach - 0.05], [to, low.y + 1.06, reach]);
        let count = ((to - from) / 0.16) as usize;
        for number in 0..=count {
            let x = from + 0.02 + (to - from - 0.04) * number as f32 / count as f32;
            let (low, high) =
                ([x - 0.012, low.y + 0.02, reach - 0.037], [x + 0.012, low.y + 1.0, reach - 0.013]);
            self.bar(solid, look.frame, low, high);
        }
    }

    /// Glass of a bay with a fin at its side and a band at its floor.
    fn curtain(&self, solid: &mut Solid, look: &Look, [low, high]: Area) {
        self.panel(solid, Surface::Curtain, [Vec2::new(low.x, low.y + 0.9), high], 0.0);
        self.panel(solid, look.wall, [low, Vec2::new(high.x, low.y + 0.9)], 0.02);
        self.bar(solid, look.frame, [low.x - 0.04, low.y, 0.0], [low.x + 0.04, high.y, 0.22]);
        self.bar(solid, look.frame, [low.x, low.y + 0.86, 0.0], [high.x, low.y + 0.92, 0.08]);
        let lintel = low.y + 0.9 + 0.72 * (high.y - low.y - 0.9);
        self.bar(solid, look.frame, [low.x, lintel, 0.0], [high.x, lintel + 0.04, 0.05]);
    }
}
