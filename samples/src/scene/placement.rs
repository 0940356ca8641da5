//! Places meshes where single precision and the renderers work well: near the origin, and neither huge nor tiny.
//!
//! Single precision leaves a mesh a thousand of its sizes away only some 14 bits of detail; rays that start on
//! such a surface hit it again. Areas and volumes of a mesh far larger or smaller than usual leave its range.

/// A mesh is moved when its centre is this many of its sizes away from the origin.
const FAR: f64 = 1_000.0;

/// Sizes, in scene units, at which meshes stay as they are.
const USUAL_SIZES: std::ops::RangeInclusive<f64> = 1e-4..=1e7;

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

    /// Half of the longest side of the box. It is finite where the whole side may not be.
    fn half_size(&self) -> f64 {
        largest(std::array::from_fn(|i| 0.5 * self.highest[i] - 0.5 * self.lowest[i]))
    }

    /// The centre, in whole units, when it is far from the origin for a mesh of this size.
    fn far_centre(&self) -> Option<[f64; 3]> {
        let half_size = self.half_size();
        let exact: [f64; 3] = std::array::from_fn(|i| 0.5 * self.lowest[i] + 0.5 * self.highest[i]);
        let is_far = half_size.is_finite() && half_size > 0.0 && 0.5 * largest(exact) / FAR > half_size;
        is_far.then(|| if half_size >= 0.5 { exact.map(f64::round) } else { exact })
    }
}

fn largest(values: [f64; 3]) -> f64 {
    values.into_iter().map(f64::abs).fold(0.0, f64::max)
}

/// Maps file units to scene units: `(position - origin) * scale * 2^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    /// Centre of a mesh far from its origin, else 0.
    origin: [f64; 3],
    /// Factor that the user or a benchmark scene asks for.
    scale: f64,
    /// Power of two that brings a mesh of unusual size to a size of 1 to 2, else 0.
    exponent: i32,
    /// Size of the mesh after `scale`, as a power of ten.
    size_log10: f64,
}

impl Placement {
    /// Chooses where a mesh goes whose used vertices have the given extent. `scale` is positive and finite.
    pub(super) fn new(extent: &Extent, scale: f32) -> Self {
        let scale = f64::from(scale);
        let half_size = extent.half_size();
        // Logarithms, since the size itself may leave the range of numbers.
        let size_log2 = half_size.log2() + 1.0 + scale.log2();
        let is_usual = USUAL_SIZES.start().log2()..=USUAL_SIZES.end().log2();
        let is_sized = half_size > 0.0 && half_size.is_finite();
        let exponent = if is_sized && !is_usual.contains(&size_log2) { -size_log2.floor() as i32 } else { 0 };
        let origin = extent.far_centre().unwrap_or_default();
        Self { origin, scale, exponent, size_log10: size_log2 * std::f64::consts::LOG10_2 }
    }

    /// Takes a position from the file to the scene.
    pub(super) fn place(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.resized(position[i] - self.origin[i]) * self.scale)
    }

    /// Takes a point that a camera file gives, in file units times `scale`, to the scene.
    pub(super) fn place_point(&self, point: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.resized(point[i] - self.origin[i] * self.scale))
    }

    /// Factor beside the scale that was asked for; 1 for meshes of usual size.
    pub(super) fn resize(&self) -> f64 {
        self.resized(1.0)
    }

    /// The value times `2^exponent`, in two steps, since the power alone may leave the range of numbers.
    fn resized(&self, value: f64) -> f64 {
        let half = self.exponent / 2;
        value * 2.0_f64.powi(half) * 2.0_f64.powi(self.exponent - half)
    }

    /// Messages for the user, if the mesh is not where the file has it.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.origin != [0.0; 3] {
            let [x, y, z] = self.origin;
            warnings
                .push(format!("the mesh lies far from its origin; ({x:?}, {y:?}, {z:?}) was taken from it"));
        }
        if self.exponent != 0 {
            warnings.push(format!(
                "the mesh is about 1e{:.0} units large; it and its cameras are drawn 2^{} times as large, \
                 to keep numbers in range",
                self.size_log10.round() + 0.0,
                self.exponent
            ));
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement(positions: &[[f64; 3]], scale: f32) -> Placement {
        let mut extent = Extent::new();
        positions.iter().for_each(|&position| extent.add(position));
        Placement::new(&extent, scale)
    }

    #[test]
    fn only_far_meshes_are_moved() {
        let origin = |positions: &[[f64; 3]]| placement(positions, 1.0).origin;
        assert_eq!(origin(&[[4e6, 0.0, 0.0], [4e6 + 2.0, 2.0, 2.0]]), [4e6 + 1.0, 1.0, 1.0]);
        assert_eq!(origin(&[[500.0, 0.0, 0.0], [501.0, 1.0, 0.0]]), [0.0; 3]);
        assert_eq!(origin(&[[1e9; 3], [1e9; 3]]), [0.0; 3], "a point has no size");
        assert_eq!(origin(&[]), [0.0; 3]);
        let moved = placement(&[[4e6, 0.0, 0.0], [4e6 + 2.0, 2.0, 2.0]], 3.0);
        assert_eq!(moved.place([4_000_000.125, 1.0, 2.0]), [-2.625, 0.0, 3.0]);
        assert_eq!(moved.place_point([12_000_000.375, 3.0, 6.0]), [-2.625, 0.0, 3.0]);
    }

    #[test]
    fn meshes_of_usual_size_keep_it_and_others_become_one_to_two_units_large() {
        for (size, scale) in [(1e-4, 1.0), (1.0, 1.0), (1e7, 1.0), (1e10, 1e-6), (1e-7, 1e6)] {
            let kept = placement(&[[0.0; 3], [size, 0.1 * size, 0.0]], scale);
            assert_eq!((kept.resize(), kept.warnings()), (1.0, Vec::new()), "{size} {scale}");
        }
        for (size, scale) in [
            (1e-300, 1.0),
            (1e-310, 1.0),
            (1e-16, 1.0),
            (1e-5, 1.0),
            (1e8, 1.0),
            (1e20, 1.0),
            (1e39, 1.0),
            (1.7e308, 1.0),
            (1.7e308, 3e38),
            (1e-300, 1e-38),
            (1.0, 1e30),
        ] {
            let resized = placement(&[[-0.5 * size; 3], [0.5 * size, 0.1 * size, 0.0]], scale);
            let low = resized.place([-0.5 * size; 3])[0];
            let high = resized.place([0.5 * size; 3])[0];
            assert!((0.999..=2.001).contains(&(high - low)), "{size} {scale}: {low} to {high}");
            assert!(resized.warnings()[0].contains("units large"), "{:?}", resized.warnings());
        }
        let warnings = placement(&[[0.0; 3], [1e10, 0.0, 0.0]], 1.0).warnings();
        assert!(
            warnings[0].starts_with("the mesh is about 1e10 units large; it and its cameras are drawn 2^-33"),
            "{warnings:?}"
        );
    }

    #[test]
    fn camera_files_and_meshes_are_resized_alike() {
        let far = [3e20, 5e20, 0.0];
        let resized = placement(&[far, [3.1e20, 5.1e20, 1e17]], 0.5);
        let [a, b] = [resized.place(far), resized.place_point(far.map(|x| 0.5 * x))];
        assert!((0..3).all(|i| (a[i] - b[i]).abs() < 1e-12), "{a:?} {b:?}");
    }
}
