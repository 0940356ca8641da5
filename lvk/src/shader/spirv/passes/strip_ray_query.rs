//! Strips the capability of ray queries from modules without a ray query.

use ::spirv::{Capability, Op};

use crate::shader::spirv::words::{HEADER_WORDS, Instruction, instructions};

const EXTENSION: &str = "SPV_KHR_ray_query";

/// Returns the module without the capability and the extension of ray queries, if it has no ray query and its types do
/// not need the capability.
///
/// DXC declares both in every ray generation shader, also for devices that have ray tracing pipelines and no ray
/// queries.
pub(crate) fn strip_unused_ray_query(words: &[u32]) -> Vec<u32> {
    let has =
        |wanted: fn(&Instruction<'_>) -> bool| instructions(words).flatten().any(|found| wanted(&found));
    let has_query = has(|found| found.op == Some(Op::TypeRayQueryKHR));
    // One of the two capabilities declares the type.
    let needs_capability = has(|found| found.op == Some(Op::TypeAccelerationStructureKHR))
        && !has(|found| is_capability(found, Capability::RayTracingKHR));
    if has_query || needs_capability {
        return words.to_vec();
    }
    let mut kept = words.get(..HEADER_WORDS).unwrap_or(words).to_vec();
    for instruction in instructions(words).flatten().filter(|found| !declares_ray_queries(found)) {
        kept.extend_from_slice(instruction.words);
    }
    kept
}

fn declares_ray_queries(instruction: &Instruction<'_>) -> bool {
    let is_extension = instruction.op == Some(Op::Extension) && instruction.string(0).0 == EXTENSION;
    is_extension || is_capability(instruction, Capability::RayQueryKHR)
}

fn is_capability(instruction: &Instruction<'_>, capability: Capability) -> bool {
    instruction.op == Some(Op::Capability) && instruction.operand(0) == capability as u32
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;
    use ::spirv::MAGIC_NUMBER;

    const QUERY: (Op, u32) = (Op::Capability, Capability::RayQueryKHR as u32);
    const TRACING: (Op, u32) = (Op::Capability, Capability::RayTracingKHR as u32);
    const STRUCTURE: (Op, u32) = (Op::TypeAccelerationStructureKHR, 1);
    const QUERY_TYPE: (Op, u32) = (Op::TypeRayQueryKHR, 2);

    /// Returns a module of instructions with one operand.
    fn module(code: &[(Op, u32)]) -> Vec<u32> {
        let header = [MAGIC_NUMBER, 0x0001_0600, 0, 3, 0];
        header
            .into_iter()
            .chain(code.iter().flat_map(|(op, operand)| [2 << 16 | *op as u32, *operand]))
            .collect()
    }

    #[test]
    fn the_capability_stays_where_something_needs_it() {
        for code in [&[QUERY, STRUCTURE][..], &[QUERY, TRACING, STRUCTURE, QUERY_TYPE], &[QUERY, QUERY_TYPE]]
        {
            assert_eq!(strip_unused_ray_query(&module(code)), module(code));
        }
    }

    #[test]
    fn the_capability_goes_where_nothing_needs_it() {
        for rest in [&[][..], &[TRACING], &[TRACING, STRUCTURE]] {
            let code = [&[QUERY], rest].concat();
            assert_eq!(strip_unused_ray_query(&module(&code)), module(rest));
            assert_eq!(strip_unused_ray_query(&module(rest)), module(rest));
        }
    }

    #[test]
    fn the_extension_goes_with_the_capability() {
        let extension = |name: &str| {
            let mut bytes = name.as_bytes().to_vec();
            bytes.resize(name.len() / 4 * 4 + 4, 0);
            let words = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
            [(bytes.len() as u32 / 4 + 1) << 16 | Op::Extension as u32]
                .into_iter()
                .chain(words)
                .collect::<Vec<_>>()
        };
        let [query, tracing] = [EXTENSION, "SPV_KHR_ray_tracing"].map(extension);
        let with = [module(&[QUERY, TRACING]), query, tracing.clone()].concat();
        assert_eq!(strip_unused_ray_query(&with), [module(&[TRACING]), tracing].concat());
    }
}
