//! Keeps values that cross blocks in variables, so that the blocks of a function can be taken apart.

use std::collections::HashMap;

use ::spirv::{Op, StorageClass};

use super::instruction::{Inst, for_each_id, used_ids};
use super::linker::Linker;
use super::module::Function;
use crate::shader::spirv::parsed::MAX_NESTING;

/// Keeps every value that another block uses, and every phi, in a variable of the function. Values that no variable can
/// hold, such as handles of images, are computed anew where they are used. The error is a message.
pub(super) fn demote_values(linker: &mut Linker, function: &mut Function) -> Result<(), String> {
    demote_phis(linker, function)?;
    let mut demotion = Demotion::collect(linker, function);
    for block in 0..function.blocks.len() {
        demotion.rewrite_uses(function, block)?;
    }
    demotion.store_values(function);
    Ok(())
}

/// Declares a variable of the function.
pub(super) fn declare_variable(linker: &mut Linker, function: &mut Function, ty: u32) -> u32 {
    let storage = StorageClass::Function;
    let pointer = linker.pointer_to(storage, ty);
    let id = linker.new_id();
    function.blocks[0].code.insert(0, Inst::new(Op::Variable, &[pointer, id, storage as u32]));
    linker.decorate_pointer_variable(id, ty);
    id
}

fn demote_phis(linker: &mut Linker, function: &mut Function) -> Result<(), String> {
    let mut stores: Vec<(u32, Inst)> = Vec::new();
    let mut types = Vec::new();
    for inst in function.code().filter(|inst| inst.op == Op::Phi) {
        types.push(inst.operand(0));
    }
    if types.iter().any(|ty| !linker.can_store(*ty)) {
        return Err("OpPhi of pointers or handles cannot be lowered here".to_owned());
    }
    let variables: Vec<u32> = types.iter().map(|ty| declare_variable(linker, function, *ty)).collect();
    let mut variables = variables.into_iter();
    for inst in function.code_mut().filter(|inst| inst.op == Op::Phi) {
        let Some(variable) = variables.next() else { break };
        for pair in inst.operands[2..].chunks_exact(2) {
            stores.push((pair[1], Inst::new(Op::Store, &[variable, pair[0]])));
        }
        *inst = Inst::new(Op::Load, &[inst.operand(0), inst.operand(1), variable]);
    }
    for (label, store) in stores {
        let Some(block) = function.blocks.iter_mut().find(|block| block.label == label) else { continue };
        let at = block.code.len() - if block.merge().is_some() { 2 } else { 1 };
        block.code.insert(at, store);
    }
    Ok(())
}

struct Demotion<'a> {
    linker: &'a mut Linker,
    /// Block and instruction of each value.
    definitions: HashMap<u32, (usize, Inst)>,
    /// Variables of demoted values.
    variables: HashMap<u32, u32>,
}

impl<'a> Demotion<'a> {
    fn collect(linker: &'a mut Linker, function: &Function) -> Self {
        let mut definitions = HashMap::new();
        for (block, of) in function.blocks.iter().enumerate() {
            for inst in of.code.iter().filter(|inst| inst.op != Op::Variable) {
                if let Some(id) = inst.result() {
                    definitions.insert(id, (block, inst.clone()));
                }
            }
        }
        Self { linker, definitions, variables: HashMap::new() }
    }

    /// Makes the block use values of its own only.
    fn rewrite_uses(&mut self, function: &mut Function, block: usize) -> Result<(), String> {
        let mut local: HashMap<u32, u32> = HashMap::new();
        let code = std::mem::take(&mut function.blocks[block].code);
        let mut out = Vec::with_capacity(code.len());
        // Nothing may stand between a merge instruction and the terminator.
        let mut merge = None;
        for mut inst in code {
            if matches!(inst.op, Op::LoopMerge | Op::SelectionMerge) {
                merge = Some(inst);
                continue;
            }
            for id in used_ids(&inst, &self.linker.module.wide) {
                self.bring(function, (block, MAX_NESTING), id, &mut local, &mut out)?;
            }
            let result = inst.result();
            let _ = for_each_id(&mut inst, &self.linker.module.wide, |id| {
                if Some(*id) != result {
                    *id = local.get(id).copied().unwrap_or(*id);
                }
            });
            out.extend(merge.take());
            out.push(inst);
        }
        function.blocks[block].code = out;
        Ok(())
    }

    /// Makes a value of another block available in `block`, as an entry of `local`. `nesting` bounds how deep values are
    /// computed from others.
    fn bring(
        &mut self,
        function: &mut Function,
        (block, nesting): (usize, u32),
        id: u32,
        local: &mut HashMap<u32, u32>,
        out: &mut Vec<Inst>,
    ) -> Result<(), String> {
        let Some((home, definition)) = self.definitions.get(&id).cloned() else { return Ok(()) };
        if home == block || local.contains_key(&id) {
            return Ok(());
        }
        let Some(ty) = definition.result_type() else { return Ok(()) };
        let copy = self.linker.new_id();
        if self.linker.can_store(ty) {
            let variable = match self.variables.get(&id) {
                Some(known) => *known,
                None => {
                    // The block is being rewritten, and its code is elsewhere: block 0 takes variables in `store_values`.
                    let variable = declare_variable(self.linker, function, ty);
                    self.variables.insert(id, variable);
                    variable
                }
            };
            out.push(Inst::new(Op::Load, &[ty, copy, variable]));
            self.linker.copy_value_decorations(&HashMap::from([(id, copy)]));
        } else {
            let repeats = matches!(
                definition.op,
                Op::AccessChain
                    | Op::InBoundsAccessChain
                    | Op::CopyObject
                    | Op::Load
                    | Op::SampledImage
                    | Op::Image
                    | Op::ImageTexelPointer
            );
            if !repeats {
                return Err(format!(
                    "Op{:?} has a result that cannot be kept while a ray is traced",
                    definition.op
                ));
            }
            let nesting = nesting.checked_sub(1).ok_or("OpAccessChain is nested too deeply")?;
            let mut again = definition;
            for used in used_ids(&again, &self.linker.module.wide) {
                self.bring(function, (block, nesting), used, local, out)?;
            }
            let _ = for_each_id(&mut again, &self.linker.module.wide, |used| {
                *used = local.get(used).copied().unwrap_or(*used);
            });
            again.set_result(copy);
            out.push(again);
            self.linker.copy_decorations(&HashMap::from([(id, copy)]));
        }
        if self.linker.module.wide.contains(&id) {
            self.linker.module.wide.insert(copy);
        }
        local.insert(id, copy);
        Ok(())
    }

    /// Stores each demoted value behind its definition.
    fn store_values(&mut self, function: &mut Function) {
        for block in &mut function.blocks {
            let mut out = Vec::with_capacity(block.code.len());
            for inst in std::mem::take(&mut block.code) {
                let variable =
                    inst.result().and_then(|id| self.variables.get(&id).map(|variable| (id, *variable)));
                out.push(inst);
                if let Some((id, variable)) = variable {
                    out.push(Inst::new(Op::Store, &[variable, id]));
                }
            }
            block.code = out;
        }
        // Variables stand first.
        if let Some(first) = function.blocks.first_mut() {
            first.code.sort_by_key(|inst| inst.op != Op::Variable);
        }
    }
}
