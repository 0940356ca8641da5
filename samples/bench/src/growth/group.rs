//! Groups of curves over the same sizes.

use super::curve::Curve;

/// A group, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GroupKey {
    Instances,
    Textures,
    Handles,
    Draws,
    Triangles,
    Loading,
}

impl GroupKey {
    /// All groups, in the order of the report.
    pub(super) const ALL: [Self; 6] =
        [Self::Instances, Self::Textures, Self::Handles, Self::Draws, Self::Triangles, Self::Loading];

    /// Returns the name on the command line and of the plot.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Instances => "instances",
            Self::Textures => "textures",
            Self::Handles => "handles",
            Self::Draws => "draws",
            Self::Triangles => "triangles",
            Self::Loading => "loading",
        }
    }

    /// Returns the title.
    pub(super) const fn title(self) -> &'static str {
        match self {
            Self::Instances => "instances of one TLAS",
            Self::Textures => "textures alive",
            Self::Handles => "buffers alive",
            Self::Draws => "draws of one pass",
            Self::Triangles => "triangles of one BLAS",
            Self::Loading => "triangles of a loaded OBJ file",
        }
    }

    /// Returns the sizes: at least seven by factors of 10 or about the square root of 10, or tiny ones for a smoke test.
    pub(super) const fn sizes(self, quick: bool) -> &'static [u64] {
        match self {
            Self::Textures if quick => &[16, 20, 24, 32],
            _ if quick => &[2, 10, 40, 100],
            Self::Instances | Self::Handles => &[1, 10, 100, 1_000, 10_000, 100_000, 1_000_000],
            Self::Textures => &[16, 100, 316, 1_000, 3_162, 10_000, 31_623, 100_000],
            Self::Draws => &[1, 10, 100, 1_000, 3_162, 10_000, 31_623, 100_000],
            Self::Triangles => &[1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000],
            Self::Loading => &[1_000, 10_000, 31_623, 100_000, 316_228, 1_000_000, 10_000_000],
        }
    }
}

/// Measured curves over the same sizes.
pub(super) struct Group {
    pub(super) key: GroupKey,
    pub(super) sizes: Vec<u64>,
    pub(super) curves: Vec<Curve>,
    pub(super) notes: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_rise_by_factors_of_at_most_ten() {
        for key in GroupKey::ALL {
            let sizes = key.sizes(false);
            assert!(sizes.len() >= 7, "{key:?}");
            for pair in sizes.windows(2) {
                let factor = pair[1] as f64 / pair[0] as f64;
                assert!((3.1..=10.0).contains(&factor), "{key:?}: {pair:?}");
            }
            assert!(key.sizes(true).is_sorted() && *key.sizes(true).last().unwrap() <= 100);
        }
    }
}
