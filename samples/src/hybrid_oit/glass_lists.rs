//! The lists of glass, as the host reads them: how many nodes a frame asked for, and what is in them.

use lvk::Context;

use super::buffers::Buffers;

/// Bytes of a node (`Node` in `shaders/hybrid_oit/frame.glsl`).
pub(super) const NODE_BYTES: u64 = 20;
/// The end of a list.
const NO_NODE: u32 = u32::MAX;

/// Nodes of the last frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NodeUse {
    /// Nodes that fragments asked for.
    pub asked: u32,
    /// Nodes in the pool.
    pub capacity: u32,
}

/// A node of a list; nodes of a pixel have no order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GlassNode {
    /// Along the pixel's ray, in scene units.
    pub distance: f32,
    /// Light that the surface adds, linear.
    pub radiance: [f32; 3],
    /// Transmitted share of the light from behind, 0 to 1.
    pub transmittance: [f32; 3],
}

/// The lists of all samples, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct GlassLists {
    heads: Vec<u32>,
    words: Vec<[u32; 5]>,
}

impl NodeUse {
    /// Nodes that did not fit: glass that the picture lacks.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.asked.saturating_sub(self.capacity)
    }
}

impl std::fmt::Display for NodeUse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { asked, capacity } = *self;
        let percent = 100.0 * f64::from(asked) / f64::from(capacity.max(1));
        match self.lost() {
            0 => write!(f, "{asked} of {capacity} nodes ({percent:.0} %)"),
            lost => write!(f, "{capacity} nodes, all used; {lost} MORE WERE LOST, use --nodes {asked}"),
        }
    }
}

impl GlassLists {
    pub(super) fn read(ctx: &Context, buffers: &Buffers, samples: usize, used: u32) -> lvk::Result<Self> {
        let mut heads = vec![0_u32; samples];
        ctx.download_buffer(*buffers.heads, 0, bytemuck::cast_slice_mut(&mut heads))?;
        let mut words = vec![[0_u32; 5]; used as usize];
        if used > 0 {
            ctx.download_buffer(*buffers.nodes, 0, bytemuck::cast_slice_mut(&mut words))?;
        }
        Ok(Self { heads, words })
    }

    /// The nodes of a sample, those added last first; none where the sample does not exist. A list that leads out of
    /// the pool or in circles, which would be a defect, ends there.
    #[must_use]
    pub fn nodes_of(&self, sample: usize) -> Vec<GlassNode> {
        let mut nodes = Vec::new();
        let mut next = self.heads.get(sample).copied().unwrap_or(NO_NODE);
        while let Some(words) = self.words.get(next as usize).filter(|_| nodes.len() < self.words.len()) {
            nodes.push(GlassNode::from_words(words));
            next = words[0];
        }
        nodes
    }

    /// Nodes in all lists together, by following them.
    #[must_use]
    pub fn linked_count(&self) -> usize {
        (0..self.heads.len()).map(|sample| self.nodes_of(sample).len()).sum()
    }
}

impl GlassNode {
    fn from_words(words: &[u32; 5]) -> Self {
        let [rg, br, gb] =
            [words[2], words[3], words[4]].map(|word| [word as u16, (word >> 16) as u16].map(half));
        Self {
            distance: f32::from_bits(words[1]),
            radiance: [rg[0], rg[1], br[0]],
            transmittance: [br[1], gb[0], gb[1]],
        }
    }
}

/// The value of a half float (IEEE 754 binary16).
pub(super) fn half(bits: u16) -> f32 {
    let sign = if bits & 0x8000 == 0 { 1.0 } else { -1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f32::from(bits & 0x3ff));
    let magnitude = match exponent {
        0 => fraction * 2.0_f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1024.0 + fraction) * 2.0_f32.powi(exponent - 25),
    };
    sign * magnitude
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_floats_are_read() {
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x0001, 5.960_464_5e-8),
            (0x7bff, 65504.0),
        ] {
            assert_eq!(half(bits), value);
        }
        assert!(half(0x7c00).is_infinite() && half(0x7e00).is_nan());
    }

    #[test]
    fn lists_are_followed_and_broken_ones_end() {
        let node = |next, distance: f32| [next, distance.to_bits(), 0, 0x3c00_0000, 0x3800_3c00];
        let lists = GlassLists {
            heads: vec![2, NO_NODE, 0, 3],
            words: vec![node(NO_NODE, 1.0), node(0, 2.0), node(1, 3.0), node(3, 4.0)],
        };
        let distances = |sample| lists.nodes_of(sample).iter().map(|node| node.distance).collect::<Vec<_>>();
        assert_eq!(distances(0), [3.0, 2.0, 1.0]);
        assert!(lists.nodes_of(1).is_empty() && lists.nodes_of(9).is_empty());
        assert_eq!(distances(3).len(), 4);
        assert_eq!(lists.nodes_of(2)[0].transmittance, [1.0, 1.0, 0.5]);
    }

    #[test]
    fn lost_nodes_are_told() {
        assert_eq!(NodeUse { asked: 50, capacity: 200 }.to_string(), "50 of 200 nodes (25 %)");
        let full = NodeUse { asked: 250, capacity: 200 };
        assert_eq!(full.lost(), 50);
        assert_eq!(full.to_string(), "200 nodes, all used; 50 MORE WERE LOST, use --nodes 250");
    }
}
