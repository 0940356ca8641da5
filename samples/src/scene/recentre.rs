//! Moves meshes that lie far from their origin (survey coordinates, say) to it while their numbers are exact.
//!
//! Single precision leaves a mesh a thousand of its sizes away only some 14 bits of detail; rays that start on
//! such a surface hit it again.

/// A mesh is moved when its centre is this many of its sizes away from the origin.
const FAR: f64 = 1_000.0;

/// Bounds of the positions seen so far.
pub(super) struct Extent {
    lowest: [f64; 3],
    highest: [f64; 3],
}

impl Extent {
    pub(super) fn new() -> Self {
        Self { lowest: [f64::INFINITY; 3], highest: [f64::NEG_INFINITY; 3] }
    }

    pub(super) fn add(&mut self, position: [f64; 3]) {
        for (i, x) in position.into_iter().enumerate() {
            self.lowest[i] = self.lowest[i].min(x);
            self.highest[i] = self.highest[i].max(x);
        }
    }

    /// The centre, in whole units, when it is far from the origin for a mesh of this size.
    pub(super) fn far_centre(&self) -> Option<[f64; 3]> {
        let largest = |values: [f64; 3]| values.into_iter().map(f64::abs).fold(0.0, f64::max);
        let size = largest(std::array::from_fn(|i| self.highest[i] - self.lowest[i]));
        let exact: [f64; 3] = std::array::from_fn(|i| 0.5 * (self.lowest[i] + self.highest[i]));
        let is_far = size.is_finite() && size > 0.0 && largest(exact) > FAR * size;
        is_far.then(|| if size >= 1.0 { exact.map(f64::round) } else { exact })
    }
}

/// The `v`, `vt` and `vn` lines of `text` with `centre` taken from every `v`.
pub(super) fn moved(text: &str, centre: [f64; 3]) -> String {
    let mut result = String::with_capacity(text.len());
    for line in text.lines() {
        match line.strip_prefix("v ") {
            Some(numbers) => {
                result.push('v');
                for (word, offset) in numbers.split_whitespace().zip(centre) {
                    let near = word.parse::<f64>().unwrap_or(offset) - offset;
                    result.push_str(&format!(" {}", near as f32));
                }
            }
            None => result.push_str(line),
        }
        result.push('\n');
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn centre(positions: &[[f64; 3]]) -> Option<[f64; 3]> {
        let mut extent = Extent::new();
        positions.iter().for_each(|&position| extent.add(position));
        extent.far_centre()
    }

    #[test]
    fn only_far_meshes_have_a_far_centre() {
        assert_eq!(centre(&[[4e6, 0.0, 0.0], [4e6 + 2.0, 2.0, 2.0]]), Some([4e6 + 1.0, 1.0, 1.0]));
        assert_eq!(centre(&[[500.0, 0.0, 0.0], [501.0, 1.0, 0.0]]), None);
        assert_eq!(centre(&[[1e9; 3], [1e9; 3]]), None);
        assert_eq!(centre(&[]), None);
    }

    #[test]
    fn moved_positions_keep_what_single_precision_would_lose() {
        let text = "v 4000000.125 1 2\nvt 0 0\nvn 0 0 1\n";
        assert_eq!(moved(text, [4e6, 1.0, 1.0]), "v 0.125 0 1\nvt 0 0\nvn 0 0 1\n");
    }
}
