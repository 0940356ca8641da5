//! Checks the memory of an acceleration structure of any builder against the assumptions of traversal.

use std::fmt::Debug;

use crate::software_ray_query::bvh::primitives::MAX_COORDINATE;

/// Minimum, maximum.
pub type CheckBounds = [[f32; 3]; 2];

/// The content of a checked acceleration structure.
#[derive(Debug, Clone, PartialEq)]
pub struct StructureFacts {
    /// Nodes on the longest path from the root to a leaf.
    pub height: u32,
    /// Number of reached nodes.
    pub node_count: u32,
    /// Geometry and primitive of each slot of the leaves; for instances, 0 and the instance index.
    pub primitives: Vec<(u32, u32)>,
    /// Vertices of each triangle, or minimum and maximum of each AABB; empty for instances.
    pub vertices: Vec<Vec<[f32; 3]>>,
    /// Bounds of everything in the leaves; the minimum is larger than the maximum if there is nothing.
    pub bounds: CheckBounds,
    /// Sum of the surface areas of all children over that of the root: the expected visits of a random ray that hits
    /// the root.
    pub cost: f64,
}

/// Bounds of nothing.
pub const EMPTY: CheckBounds = [[f32::MAX; 3], [-f32::MAX; 3]];

const NONE: u32 = u32::MAX;
const LEAF: u32 = 1 << 31;
const FORMAT_WIDE: u32 = 0;
const KIND_TRIANGLES: u32 = 0;
const KIND_INDEXED: u32 = 1;
const KIND_BOXES: u32 = 2;
const KIND_INSTANCES: u32 = 3;
const KIND_PACKED: u32 = 4;

type Checked<T> = Result<T, String>;

/// Checks an acceleration structure, given as words that start with its header.
///
/// `instance` returns the minimum bounds of an instance in the world; it is called for a TLAS only.
///
/// Every node and every slot must be reached once, and bounds must contain their subtree: exactly in binary nodes, to
/// two and a half steps in wide ones.
///
/// # Errors
/// A text that names the failed check.
pub fn check_structure(words: &[u32], instance: &dyn Fn(u32) -> CheckBounds) -> Checked<StructureFacts> {
    let mut walk = BlobChecker::new(words, instance)?;
    let root = walk.header(2);
    let (bounds, height) = match root {
        NONE => (EMPTY, 0),
        root => walk.check_subtree(root, None)?,
    };
    expect_equal("nodes", walk.header(8), walk.node_count)?;
    expect_equal("primitives", walk.header(3), walk.primitives.iter().flatten().count() as u32)?;
    let kept = [walk.vec3(12)?, walk.vec3(15)?];
    if bounds[0][0] > bounds[1][0] {
        expect_equal("bounds of nothing", kept[0][0] > kept[1][0], true)?;
    }
    // A single instance has no node whose bounds include the widening.
    let slack = if walk.header(1) == KIND_INSTANCES { [1e-5; 3] } else { [0.0; 3] };
    check_box("header", kept, bounds, slack.map(|part| part * mark_reached(kept)))?;
    if walk.header(0) != FORMAT_WIDE {
        expect_equal("height", walk.header(18), height)?;
    }
    let cost = walk.area / area(bounds).max(f64::MIN_POSITIVE);
    let primitives: Vec<_> = walk.primitives.into_iter().flatten().collect();
    let corners = walk.vertices.into_iter().flatten().collect();
    Ok(StructureFacts { height, node_count: walk.node_count, primitives, vertices: corners, bounds, cost })
}

struct BlobChecker<'a> {
    words: &'a [u32],
    instance: &'a dyn Fn(u32) -> CheckBounds,
    seen: Vec<bool>,
    node_count: u32,
    primitives: Vec<Option<(u32, u32)>>,
    vertices: Vec<Option<Vec<[f32; 3]>>>,
    area: f64,
}

/// A child of a node: its reference, its bounds as the node stores them, and the allowed difference to the true ones.
struct CheckedChild {
    reference: u32,
    slots: Option<(u32, u32)>,
    number: u32,
    kept: CheckBounds,
    slack: [f32; 3],
}

/// The content of a slot: geometry and primitive, vertices, and bounds.
struct CheckedPrimitive {
    ids: (u32, u32),
    vertices: Vec<[f32; 3]>,
    bounds: CheckBounds,
}

impl<'a> BlobChecker<'a> {
    fn new(words: &'a [u32], instance: &'a dyn Fn(u32) -> CheckBounds) -> Checked<Self> {
        if words.len() < 32 {
            return Err("the header is cut off".to_owned());
        }
        let (nodes, primitives) = (words[8] as usize, words[3] as usize);
        let most = words.len();
        if nodes > most || primitives > most {
            return Err(format!("{nodes} nodes and {primitives} primitives in {most} words"));
        }
        // Instances keep the caller's order: those that are left out leave their slots empty.
        let slots = if words[1] == KIND_INSTANCES { most / 32 } else { primitives };
        Ok(Self {
            words,
            instance,
            seen: vec![false; nodes],
            node_count: 0,
            primitives: vec![None; slots],
            vertices: vec![None; slots],
            area: 0.0,
        })
    }

    fn header(&self, word: usize) -> u32 {
        self.words[word]
    }

    fn word_at(&self, at: usize) -> Checked<u32> {
        self.words.get(at).copied().ok_or_else(|| format!("word {at} is beyond the end of the BLAS or TLAS"))
    }

    fn vec3(&self, at: usize) -> Checked<[f32; 3]> {
        let float = |axis| self.word_at(at + axis).map(f32::from_bits);
        Ok([float(0)?, float(1)?, float(2)?])
    }

    fn section_offset(&self, header_word: usize) -> usize {
        self.header(header_word) as usize * 4
    }

    /// Returns the bounds and the height of the subtree of a reference.
    fn check_subtree(&mut self, reference: u32, slots: Option<(u32, u32)>) -> Checked<(CheckBounds, u32)> {
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
        let children =
            if self.header(0) == FORMAT_WIDE { self.bvh8_children(node)? } else { self.bvh2_children(node)? };
        let (mut bounds, mut height) = (EMPTY, 0);
        for child in children {
            let (below, child_height) = self.check_subtree(child.reference, child.slots)?;
            let loose = self.header(1) == KIND_INSTANCES && child.reference & LEAF != 0;
            let slack = if loose { [mark_reached(child.kept) * 1e-5; 3] } else { child.slack };
            check_box(&format!("node {node}, child {}", child.number), child.kept, below, slack)?;
            let kept = if self.header(0) == FORMAT_WIDE { below } else { child.kept };
            self.area += area(kept);
            bounds = union_bounds(bounds, kept);
            height = height.max(child_height);
        }
        Ok((bounds, height + 1))
    }

    fn bvh2_children(&self, node: usize) -> Checked<Vec<CheckedChild>> {
        let at = self.section_offset(4) + node * 16;
        let mut children = Vec::new();
        for number in 0..2 {
            let reference = self.word_at(at + 3 + number * 4)?;
            let kept = [self.vec3(at + number * 8)?, self.vec3(at + number * 8 + 4)?];
            if reference != NONE {
                children.push(CheckedChild {
                    reference,
                    slots: None,
                    number: number as u32,
                    kept,
                    slack: [0.0; 3],
                });
            }
        }
        Ok(children)
    }

    fn bvh8_children(&self, node: usize) -> Checked<Vec<CheckedChild>> {
        let at = self.section_offset(4) + node * 20;
        let origin = self.vec3(at)?;
        let packed = self.word_at(at + 3)?;
        let internal = packed >> 24;
        let byte = |word: usize, child: usize| -> Checked<u32> {
            Ok(self.word_at(at + word + child / 4)? >> (child % 4 * 8) & 0xff)
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
                1 => (self.word_at(at + 4)? + before.count_ones(), None),
                _ => (NONE, Some((self.word_at(at + 5)? + (meta & 31), (meta >> 5).count_ones()))),
            };
            children.push(CheckedChild {
                reference,
                slots,
                number: child as u32,
                kept,
                slack: unit.map(|u| u * 2.5),
            });
        }
        Ok(children)
    }

    fn leaf(&mut self, first: u32, count: u32) -> Checked<CheckBounds> {
        let mut bounds = EMPTY;
        for slot in first..first + count {
            let CheckedPrimitive { ids, vertices: corners, bounds: own } = self.primitive(slot)?;
            match self.primitives.get_mut(slot as usize) {
                None => return Err(format!("slot {slot} does not exist")),
                Some(Some(_)) => return Err(format!("slot {slot} is in two leaves")),
                Some(kept) => *kept = Some(ids),
            }
            self.vertices[slot as usize] = Some(corners);
            bounds = union_bounds(bounds, own);
        }
        Ok(bounds)
    }

    fn primitive(&self, slot: u32) -> Checked<CheckedPrimitive> {
        let start = self.section_offset(5);
        let place = slot as usize;
        match self.header(1) {
            KIND_TRIANGLES => {
                let at = start + place * 12;
                let corners = vec![self.vec3(at)?, self.vec3(at + 4)?, self.vec3(at + 8)?];
                let ids = (self.word_at(at + 7)?, self.word_at(at + 3)?);
                let bounds = bounds_of(&corners);
                Ok(CheckedPrimitive { ids, vertices: corners, bounds })
            }
            KIND_INDEXED => {
                let at = start + place * 4;
                let names = [self.word_at(at)?, self.word_at(at + 1)?, self.word_at(at + 2)?];
                self.named_triangle(names, self.word_at(at + 3)?)
            }
            KIND_PACKED => {
                let at = start + place * 3;
                let (a, b) = (self.word_at(at)?, self.word_at(at + 1)?);
                let names = [a & 0x1f_ffff, b & 0x1f_ffff, a >> 21 | b >> 21 << 11];
                self.named_triangle(names, self.word_at(at + 2)?)
            }
            KIND_BOXES => {
                let at = start + place * 8;
                let corners = vec![self.vec3(at)?, self.vec3(at + 4)?];
                let bounds = bounds_of(&corners);
                let ids = (self.word_at(at + 7)? & !LEAF, self.word_at(at + 3)?);
                Ok(CheckedPrimitive { ids, vertices: corners, bounds })
            }
            KIND_INSTANCES => {
                let number = self.word_at(start + place * 32 + 28)?;
                Ok(CheckedPrimitive {
                    ids: (0, number),
                    vertices: Vec::new(),
                    bounds: (self.instance)(number),
                })
            }
            kind => Err(format!("leaf kind {kind} does not exist")),
        }
    }
}

impl BlobChecker<'_> {
    /// Returns the triangle with these vertex indices; `id` contains the indices of geometry and primitive.
    fn named_triangle(&self, names: [u32; 3], id: u32) -> Checked<CheckedPrimitive> {
        let mut corners = Vec::new();
        for name in names {
            corners.push(self.vec3(self.section_offset(6) + name as usize * 3)?);
        }
        let ids = if self.header(9) > 1 { (id >> 24, id & 0xff_ffff) } else { (0, id) };
        let bounds = bounds_of(&corners);
        Ok(CheckedPrimitive { ids, vertices: corners, bounds })
    }
}

/// Fails unless `kept` contains `below` and is nowhere wider than `below` by more than the slack.
fn check_box(what: &str, kept: CheckBounds, below: CheckBounds, slack: [f32; 3]) -> Checked<()> {
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

/// Returns the largest coordinate or side.
fn mark_reached(bounds: CheckBounds) -> f32 {
    let side = |axis: usize| bounds[1][axis] - bounds[0][axis];
    (0..3).fold(0.0, |most, axis| bounds[0][axis].abs().max(bounds[1][axis].abs()).max(side(axis)).max(most))
}

fn expect_equal<T: PartialEq + Debug>(what: &str, found: T, expected: T) -> Checked<()> {
    if found == expected {
        return Ok(());
    }
    Err(format!("{what}: found {found:?}, expected {expected:?}"))
}

fn bounds_of(corners: &[[f32; 3]]) -> CheckBounds {
    if corners.iter().flatten().any(|number| number.is_nan()) {
        return EMPTY;
    }
    let ended = |corner: &[f32; 3]| corner.map(|number| number.clamp(-MAX_COORDINATE, MAX_COORDINATE));
    corners.iter().map(ended).fold(EMPTY, |all, corner| union_bounds(all, [corner, corner]))
}

pub(crate) fn union_bounds(a: CheckBounds, b: CheckBounds) -> CheckBounds {
    let lo = std::array::from_fn(|axis| a[0][axis].min(b[0][axis]));
    let hi = std::array::from_fn(|axis| a[1][axis].max(b[1][axis]));
    [lo, hi]
}

fn area(bounds: CheckBounds) -> f64 {
    let side = |axis: usize| f64::from(bounds[1][axis]) - f64::from(bounds[0][axis]);
    let (x, y, z) = (side(0), side(1), side(2));
    if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
}
