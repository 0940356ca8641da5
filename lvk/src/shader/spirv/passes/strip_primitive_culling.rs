//! Strips an unused capability from modules with software ray queries.

use ::spirv::{Capability, Op};

use crate::shader::spirv::words::{HEADER_WORDS, instructions};

/// Returns the module without the capability that `layout(primitive_culling)` declares, if nothing in the module traces
/// rays by the device.
///
/// Software traversal skips kinds of primitives without a capability, and Vulkan forbids this capability alone.
pub(crate) fn strip_primitive_culling(words: &[u32]) -> Vec<u32> {
    let declares = |capability: Capability| {
        let is = |words: &[u32]| words.len() == 2 && words[1] == capability as u32;
        instructions(words).flatten().any(|found| found.op == Some(Op::Capability) && is(found.words))
    };
    if declares(Capability::RayQueryKHR) || declares(Capability::RayTracingKHR) {
        return words.to_vec();
    }
    let culling = Capability::RayTraversalPrimitiveCullingKHR as u32;
    let mut kept = words.get(..HEADER_WORDS).unwrap_or(words).to_vec();
    for instruction in instructions(words).flatten() {
        if instruction.op != Some(Op::Capability) || instruction.operand(0) != culling {
            kept.extend_from_slice(instruction.words);
        }
    }
    kept
}
