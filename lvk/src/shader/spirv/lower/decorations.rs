//! Decorations of copies.

use ::spirv::{Decoration, Op};

use super::instruction::Inst;
use super::linker::{IdMap, Linker};

/// Decorations that any value may have. Others belong to variables, parameters, types, or to the instructions that compute a value.
const OF_VALUES: [Decoration; 2] = [Decoration::NonUniform, Decoration::RelaxedPrecision];

impl Linker {
    /// Gives copies the decorations of the originals, which come of the same instructions.
    pub(super) fn copy_decorations(&mut self, copies: &IdMap) {
        self.copy_decorations_if(copies, |_| true);
    }

    /// Gives values that come of other instructions those decorations of the originals that any value may have.
    pub(super) fn copy_value_decorations(&mut self, copies: &IdMap) {
        let is_of_values = |inst: &Inst| OF_VALUES.iter().any(|kind| inst.operand(1) == *kind as u32);
        self.copy_decorations_if(copies, |inst| inst.op == Op::Decorate && is_of_values(inst));
    }

    /// Gives arguments that take the place of parameters what makes an index non-uniform. A parameter's access, aliases and precision are
    /// those of the function alone: the argument is used elsewhere too.
    pub(super) fn copy_parameter_decorations(&mut self, arguments: &IdMap) {
        let is_non_uniform = |inst: &Inst| inst.operand(1) == Decoration::NonUniform as u32;
        self.copy_decorations_if(arguments, |inst| inst.op == Op::Decorate && is_non_uniform(inst));
    }

    fn copy_decorations_if(&mut self, copies: &IdMap, is_copied: impl Fn(&Inst) -> bool) {
        let copied = self.module.decorations.iter().filter(|inst| is_copied(inst)).filter_map(|inst| {
            let copy = copies.get(&inst.operand(0))?;
            let mut inst = inst.clone();
            inst.operands[0] = *copy;
            Some(inst)
        });
        let copied: Vec<Inst> = copied.collect();
        self.module.decorations.extend(copied);
    }
}
