//! Tests that the lowering of damaged shaders ends, in words or in an error.

use proptest::prelude::*;

use super::*;
use crate::shader::spirv::lower::Traversal;
use crate::test_support::outside_pipelines::{NAME, SHADERS, lower_with};

/// Instructions of ray tracing pipelines, which a compute shader does not have.
const OF_PIPELINES: [Op; 5] = [
    Op::TraceRayKHR,
    Op::ExecuteCallableKHR,
    Op::ReportIntersectionKHR,
    Op::IgnoreIntersectionKHR,
    Op::TerminateRayKHR,
];

/// True for words of a compute shader.
fn is_compute(words: &[u32]) -> bool {
    let is_of_compute = |inst: words::Instruction<'_>| inst.op.is_none_or(|op| !OF_PIPELINES.contains(&op));
    words::validate(words).is_ok() && words::instructions(words).all(|found| found.is_ok_and(is_of_compute))
}

/// Lowers the pipeline with other words of the shader `damaged`. Returns true if it is a compute shader, or refused.
fn lowered(damaged: usize, words: &[u32]) -> bool {
    match lower_with(damaged, words, Traversal::Query) {
        Ok(words) => is_compute(&words),
        Err(error) => !error.message.is_empty() && error.shader == NAME,
    }
}

#[test]
fn the_intact_pipeline_is_lowered() {
    assert_eq!(SHADERS.len(), 6);
    for (index, (_, words)) in SHADERS.iter().enumerate() {
        assert!(lowered(index, words));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, ..ProptestConfig::default() })]

    /// Modules that the reader refuses never come to the lowering.
    #[test]
    fn damaged_shaders_are_lowered_or_refused(
        damaged in 0..6_usize,
        flips in prop::collection::vec((any::<prop::sample::Index>(), 0..32_u32), 1..3),
        swaps in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..2),
    ) {
        let (stage, intact) = &SHADERS[damaged];
        let mut words = intact.clone();
        for (place, bit) in flips {
            words[place.index(intact.len() - 5) + 5] ^= 1 << (bit % 8);
        }
        for (from, to) in swaps {
            words[to.index(intact.len() - 5) + 5] = words[from.index(intact.len() - 5) + 5];
        }
        if words::validate(&words).is_ok() && reflect("test", *stage, &words).is_ok() {
            prop_assert!(lowered(damaged, &words));
        }
    }
}
