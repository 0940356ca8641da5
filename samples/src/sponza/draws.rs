//! A scene cut into draws: triangles of one material that lie together.

use glam::Vec3;

use crate::scene::Scene;

/// Triangles of one material that lie together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    /// Number of the first triangle.
    pub first_triangle: u32,
    /// Triangles.
    pub triangle_count: u32,
    /// Lowest corner of the box around them.
    pub low: [f32; 3],
    /// Highest corner of the box.
    pub high: [f32; 3],
}

/// Puts the triangles of `scene` into the order of draws of at most `most` triangles, and answers those.
pub(super) fn split_draws(scene: &mut Scene, most: u32) -> Vec<Draw> {
    let mut order: Vec<u32> = (0..scene.triangles.len() as u32).collect();
    order.sort_by_key(|&triangle| scene.triangle_materials[triangle as usize]);
    let centres: Vec<Vec3> = (0..scene.triangles.len()).map(|triangle| centre(scene, triangle)).collect();
    let mut counts = Vec::new();
    for group in order
        .chunk_by_mut(|&a, &b| scene.triangle_materials[a as usize] == scene.triangle_materials[b as usize])
    {
        halve(group, &centres, most as usize, &mut counts);
    }
    let sorted = |from: &[u32]| order.iter().map(|&triangle| from[triangle as usize]).collect::<Vec<_>>();
    scene.triangle_materials = sorted(&scene.triangle_materials);
    scene.source_triangles = sorted(&scene.source_triangles);
    scene.triangles = order.iter().map(|&triangle| scene.triangles[triangle as usize]).collect();
    let mut start = 0;
    let draw = |count: usize| {
        let (low, high) = bounds(scene, start..start + count);
        let (first_triangle, triangle_count) = (start as u32, count as u32);
        start += count;
        Draw { first_triangle, triangle_count, low: low.into(), high: high.into() }
    };
    counts.into_iter().map(draw).collect()
}

/// Cuts triangles in the middle of their longest extent until they are few enough; appends how many each part has.
fn halve(triangles: &mut [u32], centres: &[Vec3], most: usize, counts: &mut Vec<usize>) {
    if triangles.len() <= most {
        return counts.push(triangles.len());
    }
    let at = |triangle: u32| centres[triangle as usize];
    let (low, high) = around(triangles.iter().map(|&triangle| at(triangle)));
    let axis = (high - low).max_position();
    // The number breaks ties, so that the order is the same everywhere.
    triangles.sort_unstable_by(|&a, &b| at(a)[axis].total_cmp(&at(b)[axis]).then(a.cmp(&b)));
    let (near, far) = triangles.split_at_mut(triangles.len() / 2);
    halve(near, centres, most, counts);
    halve(far, centres, most, counts);
}

fn centre(scene: &Scene, triangle: usize) -> Vec3 {
    let corners = scene.triangles[triangle].map(|vertex| Vec3::from(scene.positions[vertex as usize]));
    corners.iter().sum::<Vec3>() / 3.0
}

fn bounds(scene: &Scene, triangles: std::ops::Range<usize>) -> (Vec3, Vec3) {
    let corners = scene.triangles[triangles].iter().flatten();
    around(corners.map(|&vertex| Vec3::from(scene.positions[vertex as usize])))
}

fn around(points: impl Iterator<Item = Vec3>) -> (Vec3, Vec3) {
    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), point| (low.min(point), high.max(point)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_have_every_triangle_once_of_one_material_and_lie_together() {
        for most in [7, 256, u32::MAX] {
            let mut scene = Scene::town();
            scene.source_triangles = (0..scene.triangles.len() as u32).collect();
            let before = scene.clone();
            let draws = split_draws(&mut scene, most);
            let mut sources = scene.source_triangles.clone();
            sources.sort_unstable();
            assert!(sources.iter().copied().eq(0..before.triangles.len() as u32));
            let mut next = 0;
            for draw in &draws {
                assert_eq!(draw.first_triangle, next);
                assert!((1..=most).contains(&draw.triangle_count));
                next += draw.triangle_count;
                let range = draw.first_triangle as usize..next as usize;
                let materials = &scene.triangle_materials[range.clone()];
                assert!(materials.iter().all(|material| *material == materials[0]));
                for triangle in range {
                    let source = scene.source_triangles[triangle] as usize;
                    assert_eq!(scene.triangles[triangle], before.triangles[source]);
                    for vertex in scene.triangles[triangle] {
                        let position = scene.positions[vertex as usize];
                        assert!((0..3).all(|i| (draw.low[i]..=draw.high[i]).contains(&position[i])));
                    }
                }
            }
            assert_eq!(next as usize, scene.triangles.len());
        }
        let mut scene = Scene::town();
        assert!(split_draws(&mut scene, 64).len() < 4 * scene.triangles.len() / 64, "draws are small");
    }
}
