//! Sizes of the values that stay on the stacks of an invocation.

use ::spirv::Op;

use super::linker::Linker;
use crate::shader::spirv::parsed::MAX_NESTING;

/// Most bytes of the stacks of an invocation. Drivers keep them in memory of the thread, of which CPUs have some megabytes for all invocations that
/// a thread runs at once.
const MAX_STACK_BYTES: u32 = 64 << 10;

/// Fails for stacks of too many bytes at all levels of recursion together. The error is a message.
pub(super) fn check_stacks(bytes: u32, levels: u32) -> Result<(), String> {
    if bytes <= MAX_STACK_BYTES {
        return Ok(());
    }
    Err(format!(
        "OpTraceRayKHR and OpExecuteCallableKHR keep {bytes} bytes of values at {levels} levels of recursion; at most \
         {MAX_STACK_BYTES} are possible: lower `max_recursion` or `max_callable_depth`, or keep smaller arrays behind them"
    ))
}

/// Returns the bytes of a value of this type without padding, or any number that [`check_stacks`] refuses for more.
pub(super) fn value_bytes(linker: &Linker, ty: u32) -> u32 {
    bytes_within(linker, ty, MAX_NESTING)
}

/// In a damaged module, a type may contain itself. A struct counts as four bytes at least, so that the bound ends this.
fn bytes_within(linker: &Linker, ty: u32, nesting: u32) -> u32 {
    let (Some(nesting), Some(inst)) = (nesting.checked_sub(1), linker.global(ty)) else { return u32::MAX };
    let of = |element: u32| bytes_within(linker, element, nesting);
    match inst.op {
        Op::TypeInt | Op::TypeFloat => (inst.operand(1) / 8).max(4),
        Op::TypePointer => 8,
        Op::TypeVector | Op::TypeMatrix => of(inst.operand(1)).saturating_mul(inst.operand(2)),
        Op::TypeArray => of(inst.operand(1)).saturating_mul(linker.array_length(ty).unwrap_or(u32::MAX)),
        Op::TypeStruct => {
            let mut sum = 0_u32;
            for member in inst.operands.get(1..).unwrap_or_default() {
                // More is not allowed, and need not be counted.
                if sum > MAX_STACK_BYTES {
                    break;
                }
                sum = sum.saturating_add(of(*member));
            }
            sum.max(4)
        }
        _ => 4,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_sums_of_their_parts() {
        let mut linker = Linker::new(0x0001_0600);
        let (uint, pair) = (linker.uint(), linker.uvec2());
        assert_eq!([uint, pair].map(|ty| value_bytes(&linker, ty)), [4, 8]);
        let pairs = linker.array(pair, 10);
        let nested = linker.array(pairs, 1 << 30);
        assert_eq!(value_bytes(&linker, pairs), 80);
        assert!(value_bytes(&linker, nested) > MAX_STACK_BYTES);
        assert!(value_bytes(&linker, 0xffff) > MAX_STACK_BYTES, "no type");
    }
}
