//! Sorts triangles along a Morton curve.

use glam::Vec3;

/// Bits of a Morton code per axis.
const BITS: u32 = 10;

/// Returns the triangles in the order of the Morton codes of their centroids.
pub(super) fn morton_order(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let centroid = |triangle: &[u32; 3]| {
        triangle.iter().map(|vertex| Vec3::from(positions[*vertex as usize])).sum::<Vec3>() / 3.0
    };
    let (low, high) = triangles
        .iter()
        .map(centroid)
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let scale = ((1 << BITS) as f32 - 1.0) / (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
    let mut coded: Vec<(u32, [u32; 3])> = triangles
        .iter()
        .map(|triangle| (morton_code((centroid(triangle) - low) * scale), *triangle))
        .collect();
    coded.sort_by_key(|(code, _)| *code);
    coded.into_iter().map(|(_, triangle)| triangle).collect()
}

/// Interleaves the bits of the three coordinates.
fn morton_code(cell: Vec3) -> u32 {
    let [x, y, z] = cell.to_array().map(|number| number as u32);
    (0..BITS).fold(0, |code, bit| {
        let bit_of = |number: u32| number >> bit & 1;
        code | bit_of(x) << (3 * bit) | bit_of(y) << (3 * bit + 1) | bit_of(z) << (3 * bit + 2)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_interleaved() {
        assert_eq!(morton_code(Vec3::new(1.0, 0.0, 0.0)), 0b001);
        assert_eq!(morton_code(Vec3::new(0.0, 3.0, 0.0)), 0b010_010);
        assert_eq!(morton_code(Vec3::new(2.0, 0.0, 1.0)), 0b001_100);
    }

    #[test]
    fn triangles_of_an_octant_are_adjacent() {
        let positions: Vec<[f32; 3]> = [0.0, 0.1, 5.0, 5.1].map(|x| [x, x, x]).into();
        let triangles = [[0, 0, 1], [2, 2, 3], [0, 1, 1], [2, 3, 3]];
        let ordered = morton_order(&positions, &triangles);
        assert_eq!(ordered, [[0, 0, 1], [0, 1, 1], [2, 2, 3], [2, 3, 3]]);
    }
}
