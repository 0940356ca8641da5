//! Evaluates operations on specialization constants (`OpSpecConstantOp`), as far as array lengths need them.

use ::spirv::Op;

/// Returns the value of an operation on 32-bit integers and booleans. Returns `None` for other operations, and if the
/// operation has no value.
pub(crate) fn evaluate_spec_constant_op(op: Op, operands: &[u32]) -> Option<u32> {
    let operand = |index: usize| operands.get(index).copied();
    let (a, b) = (operand(0)?, operand(1).unwrap_or(0));
    let (signed_a, signed_b) = (a.cast_signed(), b.cast_signed());
    let value = match op {
        Op::UConvert | Op::SConvert | Op::Bitcast => a,
        Op::SNegate => a.wrapping_neg(),
        Op::Not => !a,
        Op::IAdd => a.wrapping_add(b),
        Op::ISub => a.wrapping_sub(b),
        Op::IMul => a.wrapping_mul(b),
        Op::UDiv => a.checked_div(b)?,
        Op::UMod => a.checked_rem(b)?,
        Op::SDiv => signed_a.checked_div(signed_b)?.cast_unsigned(),
        Op::SRem => signed_a.checked_rem(signed_b)?.cast_unsigned(),
        Op::SMod => {
            let rest = signed_a.checked_rem(signed_b)?;
            let other_side = rest != 0 && (rest < 0) != (signed_b < 0);
            (if other_side { rest.wrapping_add(signed_b) } else { rest }).cast_unsigned()
        }
        Op::ShiftLeftLogical => a.checked_shl(b)?,
        Op::ShiftRightLogical => a.checked_shr(b)?,
        Op::ShiftRightArithmetic => signed_a.checked_shr(b)?.cast_unsigned(),
        Op::BitwiseAnd => a & b,
        Op::BitwiseOr => a | b,
        Op::BitwiseXor => a ^ b,
        Op::Select => {
            if a != 0 {
                b
            } else {
                operand(2)?
            }
        }
        Op::LogicalNot => (a == 0).into(),
        Op::LogicalAnd => (a != 0 && b != 0).into(),
        Op::LogicalOr => (a != 0 || b != 0).into(),
        Op::LogicalEqual => ((a != 0) == (b != 0)).into(),
        Op::LogicalNotEqual => ((a != 0) != (b != 0)).into(),
        Op::IEqual => (a == b).into(),
        Op::INotEqual => (a != b).into(),
        Op::ULessThan => (a < b).into(),
        Op::ULessThanEqual => (a <= b).into(),
        Op::UGreaterThan => (a > b).into(),
        Op::UGreaterThanEqual => (a >= b).into(),
        Op::SLessThan => (signed_a < signed_b).into(),
        Op::SLessThanEqual => (signed_a <= signed_b).into(),
        Op::SGreaterThan => (signed_a > signed_b).into(),
        Op::SGreaterThanEqual => (signed_a >= signed_b).into(),
        _ => return None,
    };
    Some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_come_to_what_they_do_on_the_device() {
        let minus = |value: u32| value.wrapping_neg();
        for (op, operands, value) in [
            (Op::IMul, &[6, 7][..], Some(42)),
            (Op::ISub, &[1, 2], Some(u32::MAX)),
            (Op::UDiv, &[7, 2], Some(3)),
            (Op::UDiv, &[7, 0], None),
            (Op::SDiv, &[minus(7), 2], Some(minus(3))),
            (Op::SDiv, &[1 << 31, u32::MAX], None),
            (Op::SMod, &[minus(7), 4], Some(1)),
            (Op::SRem, &[minus(7), 4], Some(minus(3))),
            (Op::ShiftLeftLogical, &[1, 5], Some(32)),
            (Op::ShiftLeftLogical, &[1, 32], None),
            (Op::ShiftRightArithmetic, &[minus(8), 1], Some(minus(4))),
            (Op::SLessThan, &[minus(1), 1], Some(1)),
            (Op::ULessThan, &[minus(1), 1], Some(0)),
            (Op::Select, &[1, 8, 9], Some(8)),
            (Op::Select, &[0, 8, 9], Some(9)),
            (Op::Select, &[0, 8], None),
            (Op::FAdd, &[1, 1], None),
            (Op::Not, &[], None),
        ] {
            assert_eq!(evaluate_spec_constant_op(op, operands), value, "{op:?} of {operands:?}");
        }
    }
}
