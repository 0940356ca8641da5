//! Rewrites the instructions that trace rays and call callable shaders.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::donor::Donor;
use super::emit::Emitter;
use super::instruction::Inst;
use super::linker::Linker;
use super::module::Function;
use super::passed::Passed;
use super::structure_arguments::{Element, element_of};

/// Variables that the rewritten code uses.
pub(super) struct TraceVariables<'a> {
    pub(super) donor: &'a Donor,
    pub(super) payloads: Passed,
    pub(super) callables: Passed,
    /// Index of the callable shader to call.
    pub(super) callable_index: u32,
}

/// True for a trace.
pub(super) fn is_trace(inst: &Inst) -> bool {
    inst.op == Op::TraceRayKHR
}

/// True for a rewritten trace that runs no closest-hit shader.
pub(super) fn skips_closest_hit(inst: &Inst) -> bool {
    is_trace(inst) && inst.operands == SKIPS_CLOSEST_HIT
}

/// Operands of rewritten traces that run no closest-hit shader. No id is 0.
const SKIPS_CLOSEST_HIT: [u32; 1] = [0];

/// A ray that hits does not run its closest-hit shader.
pub(super) const RAY_FLAG_SKIP_CLOSEST_HIT: u32 = 0x8;

/// Stores the arguments of each trace and call of a function in variables, and leaves the bare instruction between that
/// and the copy of the payload.
pub(super) fn rewrite_traces(
    linker: &mut Linker,
    variables: &mut TraceVariables<'_>,
    function: &mut Function,
) -> Result<(), String> {
    let definitions = function.definitions();
    for block in &mut function.blocks {
        let mut out = Vec::with_capacity(block.code.len());
        for inst in std::mem::take(&mut block.code) {
            match inst.op {
                Op::TraceRayKHR => rewrite_trace(linker, variables, &definitions, &inst, &mut out)?,
                Op::ExecuteCallableKHR => rewrite_call(linker, variables, &definitions, &inst, &mut out)?,
                _ => out.push(inst),
            }
        }
        block.code = out;
    }
    remove_structures(linker, function);
    Ok(())
}

fn rewrite_trace(
    linker: &mut Linker,
    variables: &mut TraceVariables<'_>,
    definitions: &HashMap<u32, Inst>,
    inst: &Inst,
    out: &mut Vec<Inst>,
) -> Result<(), String> {
    let Some(Element { index, .. }) = element_of(linker, definitions, inst.operand(0)) else {
        return Err("the acceleration structure of OpTraceRayKHR is no element of kTLAS".to_owned());
    };
    let donor = variables.donor;
    let ty = linker.value_type(definitions, index);
    let mut emitter = Emitter::new(linker, out);
    let index = emitter.index(index, ty);
    emitter.store(donor.ray_tlas, index);
    let arguments = [
        (donor.ray_flags, inst.operand(1)),
        (donor.ray_mask, inst.operand(2)),
        (donor.ray_offset, inst.operand(3)),
        (donor.ray_stride, inst.operand(4)),
        (donor.ray_miss, inst.operand(5)),
        (donor.ray_origin, inst.operand(6)),
        (donor.ray_t_min, inst.operand(7)),
        (donor.ray_direction, inst.operand(8)),
        (donor.ray_t_max, inst.operand(9)),
    ];
    for (variable, value) in arguments {
        store_as(linker, definitions, variable, value, out);
    }
    keep_miss_bits(linker, donor, out);
    let payload = inst.operand(10);
    let flags = linker.global(inst.operand(1)).filter(|inst| inst.op == Op::Constant);
    let skips = flags.is_some_and(|inst| inst.operand(2) & RAY_FLAG_SKIP_CLOSEST_HIT != 0);
    let bare = Inst::new(Op::TraceRayKHR, if skips { &SKIPS_CLOSEST_HIT } else { &[] });
    pass(linker, &mut variables.payloads, payload, bare, out)
}

/// Keeps the bits of the miss index that count.
fn keep_miss_bits(linker: &mut Linker, donor: &Donor, out: &mut Vec<Inst>) {
    const MISS_BITS: u32 = 0xFFFF;
    let (uint, bits) = (linker.uint(), linker.constant(MISS_BITS));
    let mut emitter = Emitter::new(linker, out);
    let index = emitter.load(donor.ray_miss);
    let index = emitter.value(Op::BitwiseAnd, uint, &[index, bits]);
    emitter.store(donor.ray_miss, index);
}

fn rewrite_call(
    linker: &mut Linker,
    variables: &mut TraceVariables<'_>,
    definitions: &HashMap<u32, Inst>,
    inst: &Inst,
    out: &mut Vec<Inst>,
) -> Result<(), String> {
    store_as(linker, definitions, variables.callable_index, inst.operand(0), out);
    let bare = Inst::new(Op::ExecuteCallableKHR, &[]);
    pass(linker, &mut variables.callables, inst.operand(1), bare, out)
}

/// Copies a payload to the variable that passes it, and back behind the bare instruction.
fn pass(
    linker: &mut Linker,
    passed: &mut Passed,
    payload: u32,
    bare: Inst,
    out: &mut Vec<Inst>,
) -> Result<(), String> {
    if linker.variable_type(payload).is_none() {
        return Err(format!("the payload of Op{:?} is no variable", bare.op));
    }
    let shared = passed.variable(linker, payload);
    let mut emitter = Emitter::new(linker, out);
    emitter.copy(payload, shared);
    emitter.code.push(bare);
    emitter.copy(shared, payload);
    Ok(())
}

/// Stores a value in a variable of the same number of bits.
fn store_as(
    linker: &mut Linker,
    definitions: &HashMap<u32, Inst>,
    variable: u32,
    value: u32,
    out: &mut Vec<Inst>,
) {
    let from = linker.value_type(definitions, value);
    let to = linker.variable_type(variable).unwrap_or(0);
    let mut emitter = Emitter::new(linker, out);
    let value = emitter.convert(value, from, to);
    emitter.store(variable, value);
}

/// Removes the handles of acceleration structures that only the traces used. Those that a call passes on stay.
fn remove_structures(linker: &Linker, function: &mut Function) {
    let is_structure = |ty: u32| {
        let inner = linker.pointer(ty).map_or(ty, |(_, target)| target);
        linker.global(inner).is_some_and(|inst| inst.op == Op::TypeAccelerationStructureKHR)
    };
    let is_query = |inst: &Inst| inst.op == Op::RayQueryInitializeKHR;
    let of_structures = function.code().filter(|inst| inst.result_type().is_some_and(is_structure));
    let structures: HashSet<u32> = of_structures.filter_map(Inst::result).collect();
    let passes = |inst: &Inst| {
        inst.op == Op::FunctionCall && inst.operands[3..].iter().any(|id| structures.contains(id))
    };
    if function.code().any(|inst| is_query(inst) || passes(inst)) {
        return;
    }
    for block in &mut function.blocks {
        block.code.retain(|inst| !inst.result_type().is_some_and(is_structure));
    }
}

/// Makes the shaders see no hit remap table: the library's own traversal finds the application's own ids.
pub(super) fn hide_remap_table(linker: &mut Linker, function: &mut Function, tables: &[u32]) {
    let is_zero =
        |id: u32| linker.global(id).is_some_and(|inst| inst.op == Op::Constant && inst.operand(2) == 0);
    // A chain to the address of the table, or to the whole entry with it, which nothing else in the shader reads.
    let is_rows = |inst: &&Inst| {
        matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain)
            && tables.contains(&inst.operand(2))
            && (inst.operands.len() == 5 || inst.operands.len() == 6 && is_zero(inst.operand(5)))
    };
    let rows: Vec<u32> = function.code().filter(is_rows).filter_map(Inst::result).collect();
    for inst in function.code_mut() {
        if inst.op == Op::Load && rows.contains(&inst.operand(2)) {
            let (ty, id) = (inst.operand(0), inst.operand(1));
            *inst = Inst::new(Op::CopyObject, &[ty, id, linker.null(ty)]);
        }
    }
}
