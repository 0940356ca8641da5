//! Push constants of a lowered pipeline: the block that its shaders declare, and behind it the address of the launch.

use std::collections::BTreeMap;

use ::spirv::Op;

use super::Lowering;
use super::block_pointers::read_block_by_address;
use super::donor::Donor;
use super::instruction::{Inst, for_each_id, used_ids};
use super::linker::Linker;
use super::stage::Shader;

/// Merges the blocks of push constants of all shaders and of the donor, as a shader may have one only.
///
/// Most shaders of a pipeline declare the same block, which stays. A shader with another block, or one that leaves no
/// room for the address of the launch, reads a copy of the push constants in memory. The error is a shader and a message.
pub(super) fn merge_push_constants(
    linker: &mut Linker,
    lowering: &Lowering<'_>,
    donor: &Donor,
    shaders: &[&Shader],
) -> Result<(), (String, String)> {
    let has_room = lowering.push_constant_bytes <= lowering.launch_offset;
    let common = if has_room { common_block(linker, shaders) } else { None };
    let (variable, member) = linker.push_block(common, lowering.launch_offset);
    for shader in shaders {
        let Some(own) = shader.push else { continue };
        if common.is_some() && block_of(linker, shader) == common && reads_members_only(linker, shader, own) {
            replace_variable(linker, &shader.functions, own, variable);
        } else {
            read_block_by_address(linker, &shader.functions, own, donor.push_constants)
                .map_err(|message| (shader.name.clone(), message))?;
        }
    }
    use_merged_block(linker, donor, variable, member);
    Ok(())
}

fn block_of(linker: &Linker, shader: &Shader) -> Option<u32> {
    linker.variable_type(shader.push?)
}

/// Returns the block that most shaders declare.
fn common_block(linker: &Linker, shaders: &[&Shader]) -> Option<u32> {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for block in shaders.iter().filter_map(|shader| block_of(linker, shader)) {
        *counts.entry(block).or_default() += 1;
    }
    counts
        .into_iter()
        .max_by_key(|(block, count)| (*count, std::cmp::Reverse(*block)))
        .map(|(block, _)| block)
}

/// True if the shader reads single members of its block only, which stay what they are in a longer block.
fn reads_members_only(linker: &Linker, shader: &Shader, variable: u32) -> bool {
    let functions = shader.functions.iter().filter_map(|id| linker.function(*id));
    let is_plain = |inst: &Inst| {
        matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain)
            || !used_ids(inst, &linker.module.wide).contains(&variable)
    };
    functions.into_iter().all(|function| function.code().all(is_plain))
}

fn replace_variable(linker: &mut Linker, functions: &[u32], old: u32, new: u32) {
    let wide = linker.module.wide.clone();
    for id in functions {
        let Some(function) = linker.function_mut(*id) else { continue };
        for inst in function.code_mut() {
            let _ = for_each_id(inst, &wide, |id| *id = if *id == old { new } else { *id });
        }
    }
}

/// Makes the donor read the address of the launch from the merged block.
fn use_merged_block(linker: &mut Linker, donor: &Donor, variable: u32, member: u32) {
    let index = linker.constant(member);
    for function in &mut linker.module.functions {
        let is_read = |inst: &Inst| {
            matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain) && inst.operand(2) == donor.push
        };
        for inst in function.code_mut().filter(|inst| is_read(inst)) {
            inst.operands[2] = variable;
            inst.operands[3] = index;
        }
    }
}
