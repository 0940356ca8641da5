//! Removes what the main function does not reach, and declares the entry point.

use std::collections::{HashMap, HashSet};

use ::spirv::{Capability, ExecutionMode, ExecutionModel, Op, StorageClass};

use super::WORKGROUP_SIZE;
use super::instruction::{Inst, used_ids};
use super::linker::Linker;
use super::module::{Function, Module};

/// Returns the module of the compute shader with this main function.
pub(super) fn finish(linker: Linker, main: u32) -> Module {
    let mut module = linker.module;
    let functions = reached_functions(&module, main);
    module.functions.retain(|function| functions.contains(&function.id()));
    let globals = reached_globals(&module);
    module.globals.retain(|inst| inst.result().is_none_or(|id| globals.contains(&id)));
    let forward = |inst: &Inst| inst.op != Op::TypeForwardPointer || globals.contains(&inst.operand(0));
    module.globals.retain(forward);
    module.strings.retain(|inst| globals.contains(&inst.operand(0)));
    let local: HashSet<u32> = local_ids(&module).collect();
    let is_alive = |id: u32| globals.contains(&id) || local.contains(&id);
    module.decorations.retain(|inst| is_alive(inst.operand(0)));
    let is_variable = |inst: &&Inst| inst.op == Op::Variable;
    let interface: Vec<u32> = module.globals.iter().filter(is_variable).map(|inst| inst.operand(1)).collect();
    let name = [u32::from_le_bytes(*b"main"), 0];
    let entry = [&[ExecutionModel::GLCompute as u32, main][..], &name, &interface].concat();
    module.entry_points = vec![Inst::new(Op::EntryPoint, &entry)];
    let size = [main, ExecutionMode::LocalSize as u32, WORKGROUP_SIZE, 1, 1];
    module.modes = vec![Inst::new(Op::ExecutionMode, &size)];
    sort_functions(&mut module, main);
    finish_capabilities(&mut module);
    module
}

fn called(function: &Function) -> impl Iterator<Item = u32> {
    function.code().filter(|inst| inst.op == Op::FunctionCall).map(|inst| inst.operand(2))
}

fn reached_functions(module: &Module, main: u32) -> HashSet<u32> {
    let by_id: HashMap<u32, &Function> =
        module.functions.iter().map(|function| (function.id(), function)).collect();
    let mut reached = HashSet::from([main]);
    let mut open = vec![main];
    while let Some(function) = open.pop().and_then(|id| by_id.get(&id)) {
        open.extend(called(function).filter(|id| reached.insert(*id)));
    }
    reached
}

/// Returns the types, constants, variables and texts that the functions use.
fn reached_globals(module: &Module) -> HashSet<u32> {
    let wide = HashSet::new();
    let mut reached: HashSet<u32> = HashSet::new();
    for function in &module.functions {
        let heads = std::iter::once(&function.head).chain(&function.parameters);
        for inst in heads.chain(function.code()) {
            reached.extend(used_ids(inst, &module.wide));
        }
    }
    // Pointers that are declared before their targets refer to later ones, so passes repeat until nothing is added.
    loop {
        let before = reached.len();
        for inst in module.globals.iter().rev() {
            if inst.result().is_some_and(|id| reached.contains(&id)) {
                reached.extend(used_ids(inst, &wide));
            }
        }
        if reached.len() == before {
            return reached;
        }
    }
}

fn local_ids(module: &Module) -> impl Iterator<Item = u32> {
    module.functions.iter().flat_map(|function| {
        let heads = std::iter::once(&function.head).chain(&function.parameters);
        heads.chain(function.code()).filter_map(Inst::result)
    })
}

/// Puts the main function first.
fn sort_functions(module: &mut Module, main: u32) {
    module.functions.sort_by_key(|function| (function.id() != main, function.id()));
}

/// Keeps the capabilities that a compute shader may have.
fn finish_capabilities(module: &mut Module) {
    let uses = |ops: &[Op]| {
        module.functions.iter().any(|function| function.code().any(|inst| ops.contains(&inst.op)))
    };
    let has_query = module.globals.iter().any(|inst| inst.op == Op::TypeRayQueryKHR);
    let fetches = uses(&[Op::RayQueryGetIntersectionTriangleVertexPositionsKHR]);
    let culls =
        has_query && module.capabilities.contains(&(Capability::RayTraversalPrimitiveCullingKHR as u32));
    let uses_push = module
        .globals
        .iter()
        .any(|inst| inst.op == Op::Variable && inst.operand(2) == StorageClass::PushConstant as u32);
    debug_assert!(uses_push, "the launch is read by its address");
    let of_pipelines = [
        Capability::RayTracingKHR,
        Capability::RayTracingPositionFetchKHR,
        Capability::RayTraversalPrimitiveCullingKHR,
        Capability::RayQueryPositionFetchKHR,
        Capability::RayQueryKHR,
        Capability::RayCullMaskKHR,
    ];
    module.capabilities.retain(|own| !of_pipelines.iter().any(|gone| *gone as u32 == *own));
    let kept = [
        (Capability::RayQueryKHR, has_query),
        (Capability::RayQueryPositionFetchKHR, fetches),
        (Capability::RayTraversalPrimitiveCullingKHR, culls),
    ];
    module.capabilities.extend(kept.iter().filter(|(_, is_kept)| *is_kept).map(|(own, _)| *own as u32));
    let gone: Vec<&str> = [
        (true, "SPV_KHR_ray_tracing"),
        (true, "SPV_KHR_ray_cull_mask"),
        (!has_query, "SPV_KHR_ray_query"),
        (!fetches, "SPV_KHR_ray_tracing_position_fetch"),
    ]
    .into_iter()
    .filter_map(|(is_gone, name)| is_gone.then_some(name))
    .collect();
    module.extensions.retain(|inst| !gone.contains(&inst.text(0).as_str()));
}
