//! Checks the memory of a structure, whoever built it, against everything a traversal relies on.

use std::fmt::Debug;

use crate::software_ray_query::bvh::primitives::FARTHEST;

/// Smallest corner, largest corner.
pub type Bounds = [[f32; 3]; 2];

/// What a structure turned out to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// Nodes on the longest path from the root to a leaf.
    pub height: u32,
    /// Nodes that are reached.
    pub node_count: u32,
    /// Geometry and primitive of each slot of the leaves; of instances 0 and their number.
    pub primitives: Vec<(u32, u32)>,
    /// Corners of each triangle, or of each box; empty for instances.
    pub corners: Vec<Vec<[f32; 3]>>,
    /// Of everything in the leaves; the first corner is the larger one where there is nothing.
    pub bounds: Bounds,
    /// Sum of the areas of all children's boxes over that of the root: what a random ray that meets the root visits.
    pub cost: f64,
}

/// No bounds at all.
pub const EMPTY: Bounds = [[f32::MAX; 3], [-f32::MAX; 3]];

const NONE: u32 = u32::MAX;
const LEAF: u32 = 1 << 31;
const FORMAT_WIDE: u32 = 0;
const KIND_TRIANGLES: u32 = 0;
const KIND_INDEXED: u32 = 1;
const KIND_BOXES: u32 = 2;
const KIND_INSTANCES: u32 = 3;
const KIND_PACKED: u32 = 4;

type Checked<T> = Result<T, String>;

/// Checks a structure, given as words from its header on. `instance` answers the box in the world that an instance needs
/// at least; it is asked for top-level structures only.
///
/// Every node and every slot must be reached once, and boxes must hold what is below them: exactly in binary nodes, to two and a half steps in wide ones.
///
/// # Errors
/// What is wrong, in words.
pub fn check_structure(words: &[u32], instance: &dyn Fn(u32) -> Bounds) -> Checked<Facts> {
    let mut walk = Walk::new(words, instance)?;
    let root = walk.header(2);
    let (bounds, height) = match root {
        NONE => (EMPTY, 0),
        root => walk.visit(root, None)?,
    };
    expect("nodes", walk.header(8), walk.node_count)?;
    expect("primitives", walk.header(3), walk.primitives.iter().flatten().count() as u32)?;
    let kept = [walk.vec3(12)?, walk.vec3(15)?];
    if bounds[0][0] > bounds[1][0] {
        expect("bounds of nothing", kept[0][0] > kept[1][0], true)?;
    }
    // A single instance has no node whose box could say how wide it was made.
    let slack = if walk.header(1) == KIND_INSTANCES { [1e-5; 3] } else { [0.0; 3] };
    check_box("header", kept, bounds, slack.map(|part| part * reach(kept)))?;
    if walk.header(0) != FORMAT_WIDE {
        expect("height", walk.header(18), height)?;
    }
    let cost = walk.area / area(bounds).max(f64::MIN_POSITIVE);
    let primitives: Vec<_> = walk.primitives.into_iter().flatten().collect();
    let corners = walk.corners.into_iter().flatten().collect();
    Ok(Facts { height, node_count: walk.node_count, primitives, corners, bounds, cost })
}

struct Walk<'a> {
    words: &'a [u32],
    instance: &'a dyn Fn(u32) -> Bounds,
    seen: Vec<bool>,
    node_count: u32,
    primitives: Vec<Option<(u32, u32)>>,
    corners: Vec<Option<Vec<[f32; 3]>>>,
    area: f64,
}

/// A child of a node: what it is, its box as the node has it, and how far that may be from the true one.
struct Child {
    reference: u32,
    slots: Option<(u32, u32)>,
    number: u32,
    kept: Bounds,
    slack: [f32; 3],
}

/// What lies in a slot: geometry and primitive, corners, and the box around.
struct Primitive {
    ids: (u32, u32),
    corners: Vec<[f32; 3]>,
    bounds: Bounds,
}

impl<'a> Walk<'a> {
    fn new(words: &'a [u32], instance: &'a dyn Fn(u32) -> Bounds) -> Checked<Self> {
        if words.len() < 32 {
            return Err("the header is cut off".to_owned());
        }
        let (nodes, primitives) = (words[8] as usize, words[3] as usize);
        let most = words.len();
        if nodes > most || primitives > most {
            return Err(format!("{nodes} nodes and {primitives} primitives in {most} words"));
        }
        // Instances stay where the caller put them: those that are left out leave their slots empty.
        let slots = if words[1] == KIND_INSTANCES { most / 32 } else { primitives };
        Ok(Self {
            words,
            instance,
            seen: vec![false; nodes],
            node_count: 0,
            primitives: vec![None; slots],
            corners: vec![None; slots],
            area: 0.0,
        })
    }

    fn header(&self, word: usize) -> u32 {
        self.words[word]
    }

    fn word(&self, at: usize) -> Checked<u32> {
        self.words.get(at).copied().ok_or_else(|| format!("word {at} lies behind the structure"))
    }

    fn vec3(&self, at: usize) -> Checked<[f32; 3]> {
        let float = |axis| self.word(at + axis).map(f32::from_bits);
        Ok([float(0)?, float(1)?, float(2)?])
    }

    fn place(&self, header_word: usize) -> usize {
        self.header(header_word) as usize * 4
    }

    /// What is below a reference, and how high it is.
    fn visit(&mut self, reference: u32, slots: Option<(u32, u32)>) -> Checked<(Bounds, u32)> {
        if slots.is_some() || reference & LEAF != 0 {
            let (first, count) = slots.unwrap_or((reference & 0x07ff_ffff, (reference >> 27 & 15) + 1));
            return Ok((self.leaf(first, count)?, 0));
        }
        let node = reference as usize;
        match self.seen.get_mut(node) {
            None => return Err(format!("node {node} does not exist")),
            Some(seen) if *seen => return Err(format!("node {node} is reached twice")),
            Some(seen) => *seen = true,
        }
        self.node_count += 1;
        let children = if self.header(0) == FORMAT_WIDE { self.wide(node)? } else { self.binary(node)? };
        let (mut bounds, mut height) = (EMPTY, 0);
        for child in children {
            let (below, child_height) = self.visit(child.reference, child.slots)?;
            let loose = self.header(1) == KIND_INSTANCES && child.reference & LEAF != 0;
            let slack = if loose { [reach(child.kept) * 1e-5; 3] } else { child.slack };
            check_box(&format!("node {node}, child {}", child.number), child.kept, below, slack)?;
            let kept = if self.header(0) == FORMAT_WIDE { below } else { child.kept };
            self.area += area(kept);
            bounds = join(bounds, kept);
            height = height.max(child_height);
        }
        Ok((bounds, height + 1))
    }

    fn binary(&self, node: usize) -> Checked<Vec<Child>> {
        let at = self.place(4) + node * 16;
        let mut children = Vec::new();
        for number in 0..2 {
            let reference = self.word(at + 3 + number * 4)?;
            let kept = [self.vec3(at + number * 8)?, self.vec3(at + number * 8 + 4)?];
            if reference != NONE {
                children.push(Child { reference, slots: None, number: number as u32, kept, slack: [0.0; 3] });
            }
        }
        Ok(children)
    }

    fn wide(&self, node: usize) -> Checked<Vec<Child>> {
        let at = self.place(4) + node * 20;
        let origin = self.vec3(at)?;
        let packed = self.word(at + 3)?;
        let internal = packed >> 24;
        let byte = |word: usize, child: usize| -> Checked<u32> {
            Ok(self.word(at + word + child / 4)? >> (child % 4 * 8) & 0xff)
        };
        let unit: [f32; 3] = std::array::from_fn(|axis| f32::from_bits((packed >> (axis * 8) & 0xff) << 23));
        let mut children = Vec::new();
        for child in 0..8 {
            let meta = byte(6, child)?;
            if meta == 0 {
                continue;
            }
            let mut kept = EMPTY;
            for axis in 0..3 {
                kept[0][axis] = origin[axis] + unit[axis] * byte(8 + axis * 4, child)? as f32;
                kept[1][axis] = origin[axis] + unit[axis] * byte(10 + axis * 4, child)? as f32;
            }
            let before = internal & ((1 << child) - 1);
            let (reference, slots) = match internal >> child & 1 {
                1 => (self.word(at + 4)? + before.count_ones(), None),
                _ => (NONE, Some((self.word(at + 5)? + (meta & 31), (meta >> 5).count_ones()))),
            };
            children.push(Child {
                reference,
                slots,
                number: child as u32,
                kept,
                slack: unit.map(|u| u * 2.5),
            });
        }
        Ok(children)
    }

    fn leaf(&mut self, first: u32, count: u32) -> Checked<Bounds> {
        let mut bounds = EMPTY;
        for slot in first..first + count {
            let Primitive { ids, corners, bounds: own } = self.primitive(slot)?;
            match self.primitives.get_mut(slot as usize) {
                None => return Err(format!("slot {slot} does not exist")),
                Some(Some(_)) => return Err(format!("slot {slot} is in two leaves")),
                Some(kept) => *kept = Some(ids),
            }
            self.corners[slot as usize] = Some(corners);
            bounds = join(bounds, own);
        }
        Ok(bounds)
    }

    fn primitive(&self, slot: u32) -> Checked<Primitive> {
        let start = self.place(5);
        let place = slot as usize;
        match self.header(1) {
            KIND_TRIANGLES => {
                let at = start + place * 12;
                let corners = vec![self.vec3(at)?, self.vec3(at + 4)?, self.vec3(at + 8)?];
                let ids = (self.word(at + 7)?, self.word(at + 3)?);
                let bounds = around(&corners);
                Ok(Primitive { ids, corners, bounds })
            }
            KIND_INDEXED => {
                let at = start + place * 4;
                let names = [self.word(at)?, self.word(at + 1)?, self.word(at + 2)?];
                self.named_triangle(names, self.word(at + 3)?)
            }
            KIND_PACKED => {
                let at = start + place * 3;
                let (a, b) = (self.word(at)?, self.word(at + 1)?);
                let names = [a & 0x1f_ffff, b & 0x1f_ffff, a >> 21 | b >> 21 << 11];
                self.named_triangle(names, self.word(at + 2)?)
            }
            KIND_BOXES => {
                let at = start + place * 8;
                let corners = vec![self.vec3(at)?, self.vec3(at + 4)?];
                let bounds = around(&corners);
                let ids = (self.word(at + 7)? & !LEAF, self.word(at + 3)?);
                Ok(Primitive { ids, corners, bounds })
            }
            KIND_INSTANCES => {
                let number = self.word(start + place * 32 + 28)?;
                Ok(Primitive { ids: (0, number), corners: Vec::new(), bounds: (self.instance)(number) })
            }
            kind => Err(format!("leaf kind {kind} does not exist")),
        }
    }
}

impl Walk<'_> {
    /// The triangle of these vertices; `id` has the numbers of geometry and primitive.
    fn named_triangle(&self, names: [u32; 3], id: u32) -> Checked<Primitive> {
        let mut corners = Vec::new();
        for name in names {
            corners.push(self.vec3(self.place(6) + name as usize * 3)?);
        }
        let ids = if self.header(9) > 1 { (id >> 24, id & 0xff_ffff) } else { (0, id) };
        let bounds = around(&corners);
        Ok(Primitive { ids, corners, bounds })
    }
}

/// Fails unless a box holds another and is nowhere wider than that by more than the slack.
fn check_box(what: &str, kept: Bounds, below: Bounds, slack: [f32; 3]) -> Checked<()> {
    if below[0][0] > below[1][0] {
        return Ok(());
    }
    for axis in 0..3 {
        let (outer, inner) = ([kept[0][axis], kept[1][axis]], [below[0][axis], below[1][axis]]);
        if !(outer[0] <= inner[0] && outer[1] >= inner[1]) {
            return Err(format!("{what}: {outer:?} does not hold {inner:?}"));
        }
        if outer[0] < inner[0] - slack[axis] || outer[1] > inner[1] + slack[axis] {
            return Err(format!("{what}: {outer:?} is wider than {inner:?}"));
        }
    }
    Ok(())
}

/// The largest coordinate or side.
fn reach(bounds: Bounds) -> f32 {
    let side = |axis: usize| bounds[1][axis] - bounds[0][axis];
    (0..3).fold(0.0, |most, axis| bounds[0][axis].abs().max(bounds[1][axis].abs()).max(side(axis)).max(most))
}

fn expect<T: PartialEq + Debug>(what: &str, found: T, expected: T) -> Checked<()> {
    if found == expected {
        return Ok(());
    }
    Err(format!("{what}: found {found:?}, expected {expected:?}"))
}

fn around(corners: &[[f32; 3]]) -> Bounds {
    if corners.iter().flatten().any(|number| number.is_nan()) {
        return EMPTY;
    }
    let ended = |corner: &[f32; 3]| corner.map(|number| number.clamp(-FARTHEST, FARTHEST));
    corners.iter().map(ended).fold(EMPTY, |all, corner| join(all, [corner, corner]))
}

fn join(a: Bounds, b: Bounds) -> Bounds {
    let lo = std::array::from_fn(|axis| a[0][axis].min(b[0][axis]));
    let hi = std::array::from_fn(|axis| a[1][axis].max(b[1][axis]));
    [lo, hi]
}

fn area(bounds: Bounds) -> f64 {
    let side = |axis: usize| f64::from(bounds[1][axis]) - f64::from(bounds[0][axis]);
    let (x, y, z) = (side(0), side(1), side(2));
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}
