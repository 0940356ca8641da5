//! Stack size of ray tracing pipelines.

use crate::shader::ShaderStage;

/// The largest stack of each kind of shader, in bytes, over all groups of a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct StackSizes {
    ray_gen: u64,
    miss: u64,
    closest_hit: u64,
    any_hit: u64,
    intersection: u64,
    callable: u64,
}

impl StackSizes {
    /// Adds one shader of one group.
    pub(crate) fn add(&mut self, stage: ShaderStage, bytes: u64) {
        let largest = match stage {
            ShaderStage::RayGen => &mut self.ray_gen,
            ShaderStage::Miss => &mut self.miss,
            ShaderStage::ClosestHit => &mut self.closest_hit,
            ShaderStage::AnyHit => &mut self.any_hit,
            ShaderStage::Intersection => &mut self.intersection,
            ShaderStage::Callable => &mut self.callable,
            _ => return,
        };
        *largest = bytes.max(*largest);
    }

    /// Returns the stack size of one ray in bytes: Vulkan's "Ray Tracing Pipeline Stack", with `callable_depth` in
    /// place of its 2.
    ///
    /// A ray generation shader traces a ray, whose closest-hit or miss shader traces the next ray, up to a depth of
    /// `recursion`. Intersection and any-hit shaders trace no rays, so only those of the last ray can be on top of the
    /// stack. Callable shaders may be on top of any shader.
    pub(crate) fn pipeline_bytes(&self, recursion: u32, callable_depth: u32) -> u64 {
        let shade = self.closest_hit.max(self.miss);
        let last = shade.max(self.intersection.saturating_add(self.any_hit));
        let deeper = u64::from(recursion.saturating_sub(1)).saturating_mul(shade);
        let calls = u64::from(callable_depth).saturating_mul(self.callable);
        let last = if recursion == 0 { 0 } else { last };
        self.ray_gen.saturating_add(last).saturating_add(deeper).saturating_add(calls)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const STAGES: [ShaderStage; 6] = [
        ShaderStage::RayGen,
        ShaderStage::Miss,
        ShaderStage::ClosestHit,
        ShaderStage::AnyHit,
        ShaderStage::Intersection,
        ShaderStage::Callable,
    ];

    fn shaders() -> impl Strategy<Value = Vec<(ShaderStage, u64)>> {
        prop::collection::vec((prop::sample::select(STAGES.to_vec()), 0..5_000_u64), 0..20)
    }

    fn sizes(shaders: &[(ShaderStage, u64)]) -> StackSizes {
        let mut sizes = StackSizes::default();
        shaders.iter().for_each(|(stage, bytes)| sizes.add(*stage, *bytes));
        sizes
    }

    /// Returns the deepest stack by trying every chain of calls, without the formula.
    fn deepest(shaders: &[(ShaderStage, u64)], recursion: u32, callable_depth: u32) -> u64 {
        let of = |stage| {
            let all = shaders.iter().filter(move |(other, _)| *other == stage);
            all.map(|(_, bytes)| *bytes).chain([0]).collect::<Vec<_>>()
        };
        fn trace(of: &dyn Fn(ShaderStage) -> Vec<u64>, rays: u32) -> u64 {
            if rays == 0 {
                return 0;
            }
            let shade = [of(ShaderStage::Miss), of(ShaderStage::ClosestHit)].concat();
            let shade = shade.iter().map(|own| own + trace(of, rays - 1));
            let candidates = of(ShaderStage::Intersection);
            let any_hits = of(ShaderStage::AnyHit);
            let candidates = candidates.iter().flat_map(|a| any_hits.iter().map(move |b| a + b));
            shade.chain(candidates).max().unwrap_or(0)
        }
        let below = of(ShaderStage::RayGen).iter().map(|own| own + trace(&of, recursion)).max();
        let calls = of(ShaderStage::Callable).iter().max().map_or(0, |own| own * u64::from(callable_depth));
        below.unwrap_or(0) + calls
    }

    proptest! {
        #[test]
        fn no_chain_of_calls_is_deeper(shaders in shaders(), recursion in 0..3_u32, calls in 0..4_u32) {
            let bytes = sizes(&shaders).pipeline_bytes(recursion, calls);
            let deepest = deepest(&shaders, recursion, calls);
            prop_assert!(bytes >= deepest);
            if recursion <= 1 {
                prop_assert_eq!(bytes, deepest);
            }
        }

        #[test]
        fn the_order_of_groups_does_not_matter(shaders in shaders(), turn in 0..20_usize, depth in 1..9_u32) {
            let mut turned = shaders.clone();
            turned.rotate_left(turn.min(shaders.len()));
            prop_assert_eq!(sizes(&shaders), sizes(&turned));
            let bytes = sizes(&shaders).pipeline_bytes(depth, 1);
            prop_assert!(sizes(&shaders).pipeline_bytes(depth + 1, 1) >= bytes);
            prop_assert!(sizes(&shaders).pipeline_bytes(depth, 2) >= bytes);
        }
    }

    #[test]
    fn each_term_of_the_formula() {
        let all = STAGES.into_iter().zip([1, 10, 100, 1_000, 10_000, 100_000]).collect::<Vec<_>>();
        let sizes = sizes(&all);
        assert_eq!(sizes.pipeline_bytes(1, 0), 11_001);
        assert_eq!(sizes.pipeline_bytes(1, 2), 211_001);
        assert_eq!(sizes.pipeline_bytes(3, 1), 111_201);
        assert_eq!(sizes.pipeline_bytes(0, 1), 100_001);
    }

    #[test]
    fn sizes_beyond_64_bits_saturate() {
        let mut sizes = StackSizes::default();
        sizes.add(ShaderStage::ClosestHit, u64::MAX);
        sizes.add(ShaderStage::Callable, u64::MAX / 2);
        assert_eq!(sizes.pipeline_bytes(u32::MAX, u32::MAX), u64::MAX);
    }
}
