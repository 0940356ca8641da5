//! Keeps images with their samplers: the result of `OpSampledImage` is used in the block that makes it.

use std::collections::HashMap;

use ::spirv::Op;

use super::instruction::{Inst, for_each_id, used_ids};
use super::linker::Linker;

/// Makes each sampled image of the functions anew in front of every instruction that uses it. A compiler may make it long before,
/// and a block that is split between the two has it no more.
pub(super) fn repeat_sampled_images(linker: &mut Linker, functions: &[u32]) {
    for id in functions {
        let Some(mut function) = linker.take_function(*id) else { continue };
        for block in &mut function.blocks {
            if block.code.iter().any(|inst| inst.op == Op::SampledImage) {
                block.code = repeated(linker, std::mem::take(&mut block.code));
            }
        }
        linker.module.functions.push(function);
    }
}

fn repeated(linker: &mut Linker, code: Vec<Inst>) -> Vec<Inst> {
    let mut sampled: HashMap<u32, Inst> = HashMap::new();
    let mut out = Vec::with_capacity(code.len());
    for mut inst in code {
        if let Some(id) = inst.result().filter(|_| inst.op == Op::SampledImage) {
            sampled.insert(id, inst);
            continue;
        }
        let mut copies = HashMap::new();
        for id in used_ids(&inst, &linker.module.wide) {
            let Some(mut again) = sampled.get(&id).filter(|_| !copies.contains_key(&id)).cloned() else {
                continue;
            };
            let copy = linker.new_id();
            again.set_result(copy);
            copies.insert(id, copy);
            out.push(again);
        }
        let _ =
            for_each_id(&mut inst, &linker.module.wide, |id| *id = copies.get(id).copied().unwrap_or(*id));
        linker.copy_decorations(&copies);
        out.push(inst);
    }
    out
}
