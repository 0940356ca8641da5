//! Moves the decorations of a copied `OpSampledImage` to the `OpSampledImage` itself.

use std::collections::HashSet;

use ::spirv::Op;

use crate::shader::spirv::words::{HEADER_WORDS, Instruction, instructions};

/// Returns `words` without copies of `OpSampledImage`, which the GLSL compiler emits for
/// `nonuniformEXT(sampler2D(...))`.
///
/// The `OpSampledImage` takes the id of its copy, and thereby the decorations. SPIR-V allows only sampling instructions
/// to use an `OpSampledImage`. SwiftShader reads `NonUniform` only from the `OpSampledImage` itself.
pub(crate) fn merge_sampled_images(words: Vec<u32>) -> Vec<u32> {
    let Ok(code) = instructions(&words).collect::<Result<Vec<_>, _>>() else {
        return words;
    };
    let decorated: HashSet<u32> =
        code.iter().filter(|i| i.op == Some(Op::Decorate)).map(|i| i.operand(0)).collect();
    let mut out = words.get(..HEADER_WORDS).unwrap_or(&words).to_vec();
    let mut rest = code.as_slice();
    while let [first, after @ ..] = rest {
        rest = match after {
            [copy, after @ ..] if is_copy_of(copy, first) && !decorated.contains(&first.operand(1)) => {
                out.extend([
                    first.words[0],
                    first.operand(0),
                    copy.operand(1),
                    first.operand(2),
                    first.operand(3),
                ]);
                after
            }
            _ => {
                out.extend(first.words);
                after
            }
        };
    }
    out
}

/// True if `next` copies the result of `combination`.
fn is_copy_of(next: &Instruction<'_>, combination: &Instruction<'_>) -> bool {
    combination.op == Some(Op::SampledImage)
        && next.op == Some(Op::CopyObject)
        && combination.words.len() == 5
        && next.words.len() == 4
        && next.operand(2) == combination.operand(1)
}
