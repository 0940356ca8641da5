//! Decorates images and samplers of descriptor arrays with `NonUniform`.
//!
//! An index that is the same for all rays needs no decoration. SwiftShader then takes the index of a vector's first lane for all
//! lanes. In a lowered pipeline that lane may be idle, because its ray has ended, and holds any index.

use std::collections::HashSet;

use ::spirv::{Capability, Decoration, Op, StorageClass};

use super::instruction::Inst;
use super::linker::{Linker, add_new};

/// Decorates every image and sampler that an index selects.
pub(super) fn decorate_non_uniform(linker: &mut Linker) {
    let arrays = descriptor_arrays(linker);
    let module = &mut linker.module;
    let mut selected: Vec<u32> = Vec::new();
    for function in &module.functions {
        let mut known: HashSet<u32> = HashSet::new();
        for inst in function.code() {
            let is_selected = match inst.op {
                Op::AccessChain | Op::InBoundsAccessChain => arrays.contains(&inst.operand(2)),
                Op::SampledImage => [2, 3].iter().any(|place| known.contains(&inst.operand(*place))),
                Op::Load | Op::CopyObject | Op::Image | Op::ImageTexelPointer => {
                    known.contains(&inst.operand(2))
                }
                _ => false,
            };
            if let Some(id) = inst.result().filter(|_| is_selected) {
                known.insert(id);
                selected.push(id);
            }
        }
    }
    if selected.is_empty() {
        return;
    }
    let decoration = Decoration::NonUniform as u32;
    let has = |inst: &Inst| inst.op == Op::Decorate && inst.operand(1) == decoration;
    let decorated: HashSet<u32> =
        module.decorations.iter().filter(|inst| has(inst)).map(|inst| inst.operand(0)).collect();
    selected.retain(|id| !decorated.contains(id));
    module.decorations.extend(selected.iter().map(|id| Inst::new(Op::Decorate, &[*id, decoration])));
    let needed = [
        Capability::ShaderNonUniform,
        Capability::SampledImageArrayNonUniformIndexing,
        Capability::StorageImageArrayNonUniformIndexing,
    ];
    add_new(&mut module.capabilities, needed.map(|capability| capability as u32).to_vec());
}

/// Returns the variables that hold arrays of images or samplers.
fn descriptor_arrays(linker: &Linker) -> HashSet<u32> {
    let storage = StorageClass::UniformConstant as u32;
    let is_array = |variable: &u32| {
        let target = linker.variable_type(*variable).and_then(|ty| linker.global(ty));
        target.is_some_and(|inst| matches!(inst.op, Op::TypeArray | Op::TypeRuntimeArray))
    };
    let globals = linker.module.globals.iter();
    let variables = globals.filter(|inst| inst.op == Op::Variable && inst.operand(2) == storage);
    variables.map(|inst| inst.operand(1)).filter(is_array).collect()
}
