//! Specialization constants of a module that is lowered.

use std::collections::HashMap;

use ::spirv::{Decoration, Op};

use super::instruction::Inst;
use super::module::Module;
use crate::shader::spirv::const_eval::evaluate_spec_constant_op;

/// Gives specialization constants their values, and evaluates operations on them, after which they are plain constants.
///
/// Operations on other values than 32-bit integers and booleans stay as they are.
pub(super) fn freeze_constants(module: &mut Module, values: &[(u32, u64)]) {
    let is_spec_id = |inst: &Inst| inst.op == Op::Decorate && inst.operand(1) == Decoration::SpecId as u32;
    let given: HashMap<u32, u64> = module
        .decorations
        .iter()
        .filter(|inst| is_spec_id(inst))
        .filter_map(|inst| {
            let value = values.iter().find(|(id, _)| *id == inst.operand(2));
            value.map(|(_, bits)| (inst.operand(0), *bits))
        })
        .collect();
    module.decorations.retain(|inst| !is_spec_id(inst));
    for inst in &mut module.globals {
        let value = given.get(&inst.operand(1));
        match inst.op {
            Op::SpecConstantTrue | Op::SpecConstantFalse => {
                let is_true = value.map_or(inst.op == Op::SpecConstantTrue, |bits| *bits != 0);
                inst.op = if is_true { Op::ConstantTrue } else { Op::ConstantFalse };
            }
            Op::SpecConstant => {
                inst.op = Op::Constant;
                if let Some(bits) = value {
                    let words = [*bits as u32, (*bits >> 32) as u32];
                    inst.operands.iter_mut().skip(2).zip(words).for_each(|(own, word)| *own = word);
                }
            }
            Op::SpecConstantComposite => inst.op = Op::ConstantComposite,
            _ => {}
        }
    }
    evaluate_operations(module);
}

/// Replaces the operations on constants that have a value by that value.
fn evaluate_operations(module: &mut Module) {
    let mut known = Known::default();
    for inst in &mut module.globals {
        if inst.op == Op::SpecConstantOp {
            known.evaluate(inst);
        }
        known.insert(inst);
    }
}

/// The types and constants of a module, as far as operations need them.
#[derive(Default)]
struct Known {
    /// Integers of 32 bits, and booleans.
    values: HashMap<u32, u32>,
    composites: HashMap<u32, Vec<u32>>,
    /// Types of these values: true for booleans.
    types: HashMap<u32, bool>,
}

impl Known {
    fn insert(&mut self, inst: &Inst) {
        const BITS: u32 = 32;
        let is_known = self.types.contains_key(&inst.operand(0));
        let id = inst.operand(1);
        match inst.op {
            Op::TypeBool => _ = self.types.insert(inst.operand(0), true),
            Op::TypeInt if inst.operand(1) == BITS => _ = self.types.insert(inst.operand(0), false),
            Op::Constant if is_known => _ = self.values.insert(id, inst.operand(2)),
            Op::ConstantTrue => _ = self.values.insert(id, 1),
            Op::ConstantFalse => _ = self.values.insert(id, 0),
            Op::ConstantNull if is_known => _ = self.values.insert(id, 0),
            Op::ConstantComposite => _ = self.composites.insert(id, inst.operands[2..].to_vec()),
            _ => {}
        }
    }

    /// Makes the operation a plain constant if it has a value.
    fn evaluate(&self, inst: &mut Inst) {
        let (ty, id) = (inst.operand(0), inst.operand(1));
        let Some(value) = self.value_of(inst) else { return };
        *inst = match self.types.get(&ty) {
            Some(true) => Inst::new(if value == 0 { Op::ConstantFalse } else { Op::ConstantTrue }, &[ty, id]),
            Some(false) => Inst::new(Op::Constant, &[ty, id, value]),
            None => return,
        };
    }

    fn value_of(&self, inst: &Inst) -> Option<u32> {
        let op = Op::from_u32(inst.operand(2))?;
        let operands = inst.operands.get(3..)?;
        if op == Op::CompositeExtract {
            let (composite, path) = operands.split_first()?;
            let part = path.iter().try_fold(*composite, |part, index| {
                self.composites.get(&part)?.get(*index as usize).copied()
            });
            return self.values.get(&part?).copied();
        }
        let values: Option<Vec<u32>> = operands.iter().map(|id| self.values.get(id).copied()).collect();
        evaluate_spec_constant_op(op, &values?)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test")]
mod tests {
    use super::*;

    const UINT: u32 = 1;
    const BOOL: u32 = 2;
    const PAIR: u32 = 3;
    const LONG: u32 = 4;

    /// Returns the constants behind `UINT` 10 with the constant id 7 and the default 5, and `UINT` 11 with the value 3.
    fn frozen(rest: &[(Op, &[u32])], values: &[(u32, u64)]) -> Vec<Inst> {
        let mut module = Module::default();
        module.decorations.push(Inst::new(Op::Decorate, &[10, Decoration::SpecId as u32, 7]));
        let first: [(Op, &[u32]); 6] = [
            (Op::TypeInt, &[UINT, 32, 0]),
            (Op::TypeBool, &[BOOL]),
            (Op::TypeVector, &[PAIR, UINT, 2]),
            (Op::TypeInt, &[LONG, 64, 0]),
            (Op::SpecConstant, &[UINT, 10, 5]),
            (Op::Constant, &[UINT, 11, 3]),
        ];
        let all = first.iter().chain(rest);
        module.globals = all.map(|(op, words)| Inst::new(*op, words)).collect();
        freeze_constants(&mut module, values);
        assert!(module.decorations.is_empty());
        module.globals.split_off(first.len())
    }

    #[test]
    fn operations_on_operations_have_the_value_of_the_constants() {
        let (add, less) = (Op::IAdd as u32, Op::ULessThan as u32);
        let extract = Op::CompositeExtract as u32;
        let rest: [(Op, &[u32]); 4] = [
            (Op::SpecConstantOp, &[UINT, 12, add, 10, 11]),
            (Op::SpecConstantComposite, &[PAIR, 13, 11, 12]),
            (Op::SpecConstantOp, &[UINT, 14, extract, 13, 1]),
            (Op::SpecConstantOp, &[BOOL, 15, less, 14, 11]),
        ];
        for (values, sum, is_less) in
            [(&[][..], 8, false), (&[(7, 100)], 103, false), (&[(7, u64::from(u32::MAX))], 2, true)]
        {
            let found = frozen(&rest, values);
            assert_eq!(found[0], Inst::new(Op::Constant, &[UINT, 12, sum]));
            assert_eq!(found[2], Inst::new(Op::Constant, &[UINT, 14, sum]));
            let op = if is_less { Op::ConstantTrue } else { Op::ConstantFalse };
            assert_eq!(found[3], Inst::new(op, &[BOOL, 15]));
        }
    }

    #[test]
    fn operations_without_a_known_value_stay() {
        let (divide, extend) = (Op::UDiv as u32, Op::UConvert as u32);
        let rest: [(Op, &[u32]); 4] = [
            (Op::Constant, &[UINT, 12, 0]),
            (Op::SpecConstantOp, &[UINT, 13, divide, 10, 12]),
            (Op::SpecConstantOp, &[LONG, 14, extend, 10]),
            (Op::SpecConstantOp, &[UINT, 15, extend, 14]),
        ];
        let found = frozen(&rest, &[]);
        assert!(found[1..].iter().all(|inst| inst.op == Op::SpecConstantOp), "{found:?}");
    }
}
