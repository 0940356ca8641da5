//! The range (Tmax) of reflected rays.

/// Rays of a mirror go this far, in scene units: beyond the scene.
pub const FAR: f32 = 200.0;
/// Roughness from which no ray is traced: the lobe shows no more than the ambient light does.
pub const ROUGHEST_TRACED: f32 = 0.7;
/// Below this roughness a surface is a mirror, whose rays go all the way.
const MIRROR_ROUGHNESS: f32 = 0.08;
/// Width of the lobe at the end of a shortened ray, in scene units.
const BLURRED_EXTENT: f32 = 2.5;

/// Length of the ray that finds what a surface of `roughness` (0 to 1) reflects, in scene units; 0 where none is
/// traced.
///
/// The lobe of the microfacet model is about `roughness * roughness` wide for each unit of length. Beyond the length
/// at which it is wider than the objects of the scene, the hit of a single ray tells nothing about the average.
/// Ambient light replaces it there. So the ray may end at that length, which saves the traversal of everything farther
/// away. `shaders/reflections/ray_range.glsl` has the same rule.
#[must_use]
pub fn reflection_range(roughness: f32) -> f32 {
    match roughness {
        r if r < MIRROR_ROUGHNESS => FAR,
        r if r < ROUGHEST_TRACED => (BLURRED_EXTENT / (r * r)).min(FAR),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_see_everything_and_the_roughest_surfaces_trace_nothing() {
        assert_eq!((reflection_range(0.0), reflection_range(0.079)), (FAR, FAR));
        assert_eq!((reflection_range(0.7), reflection_range(1.0)), (0.0, 0.0));
    }

    #[test]
    fn rays_get_shorter_the_rougher_the_surface() {
        let ranges: Vec<f32> = (0..=100).map(|step| reflection_range(step as f32 / 100.0)).collect();
        assert!(ranges.windows(2).all(|pair| pair[1] <= pair[0]), "{ranges:?}");
        assert!(reflection_range(0.15) < FAR && reflection_range(0.5) < 0.1 * FAR);
    }

    #[test]
    fn the_lobe_is_equally_wide_at_the_end_of_all_shortened_rays() {
        for roughness in [0.2_f32, 0.3, 0.5, 0.69] {
            let width = reflection_range(roughness) * roughness * roughness;
            assert!((width - BLURRED_EXTENT).abs() < 1e-5, "{roughness}: {width}");
        }
    }
}
