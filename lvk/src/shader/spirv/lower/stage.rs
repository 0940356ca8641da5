//! Links one shader of a pipeline: its variables become those of the invocation, and its roles are collected.

use std::collections::{BTreeSet, HashSet};

use ::spirv::{BuiltIn, Capability, Decoration, ExecutionModel, Op, StorageClass};

use super::StageModule;
use super::constants::freeze_constants;
use super::instruction::Inst;
use super::linker::{Linker, MAX_PASSED};
use super::module::{Function, Module};
use super::passed::Passed;
use super::scopes::widen_scopes;
use crate::bindless::layout;
use crate::shader::ShaderStage;

/// A linked shader.
#[derive(Debug, Default)]
pub(super) struct Shader {
    pub(super) name: String,
    /// Entry function.
    pub(super) entry: u32,
    /// All functions, the entry included.
    pub(super) functions: Vec<u32>,
    /// Variables of built-in values.
    pub(super) builtins: Vec<(BuiltIn, u32)>,
    /// Other variables that an invocation of the shader has for itself.
    pub(super) own: Vec<u32>,
    /// Variables with the constants that they start with.
    pub(super) initial: Vec<(u32, u32)>,
    pub(super) incoming_payload: Option<u32>,
    pub(super) incoming_callable: Option<u32>,
    pub(super) attributes: Option<u32>,
    /// The block of the shader record, and the block of push constants: variables that point to memory.
    pub(super) record: Option<u32>,
    pub(super) push: Option<u32>,
    /// The table beside `kTLAS`.
    pub(super) tlas_tables: Vec<u32>,
    /// Values of built-ins that do not change in an invocation: the shader's variable, and the input of the module.
    pub(super) inputs: Vec<(u32, u32)>,
}

impl Shader {
    /// Returns pairs of a variable of the shader and the one that it is copied to when the shader has run.
    pub(super) fn results(
        &self,
        linker: &mut Linker,
        payloads: &mut Passed,
        callables: &mut Passed,
    ) -> Vec<(u32, u32)> {
        let payload = self.incoming_payload.map(|own| (own, payloads.variable(linker, own)));
        let callable = self.incoming_callable.map(|own| (own, callables.variable(linker, own)));
        payload.into_iter().chain(callable).collect()
    }
}

/// The role of a variable, from its storage class and its decorations.
enum Role {
    BuiltIn(BuiltIn),
    Input(BuiltIn),
    IncomingPayload,
    IncomingCallable,
    Attributes,
    /// A payload or data of a shader that traces or calls.
    Outgoing,
    Record,
    Push,
    TlasTable,
    Own,
    /// Descriptors and the like.
    Shared,
}

impl Role {
    /// True for a variable whose value passes from one shader to another.
    fn is_passed(&self) -> bool {
        matches!(self, Self::IncomingPayload | Self::IncomingCallable | Self::Attributes | Self::Outgoing)
    }
}

/// Links a shader. The error is a message.
pub(super) fn link_stage(linker: &mut Linker, stage: &StageModule<'_>) -> Result<Shader, String> {
    let mut module = Module::parse(stage.words)?;
    check_module(&module)?;
    let entry = take_entry(&mut module, stage.stage)?;
    check_instructions(&module, stage.stage)?;
    freeze_constants(&mut module, stage.specialization);
    join_equal_branches(&mut module);
    let roles = roles(&module, &entry);
    let initial = take_initial_values(&mut module);
    store_initial_values(&mut module);
    convert_storage(&mut module);
    widen_scopes(&mut module);
    let own_functions: Vec<u32> = module.functions.iter().map(Function::id).collect();
    let ids = linker.link(module).map_err(|unknown| format!("Op{:?} cannot be lowered", unknown.0))?;
    let of = |id: u32| ids.get(&id).copied().unwrap_or(0);
    let mut shader = Shader {
        name: stage.name.to_owned(),
        entry: of(entry.function),
        functions: own_functions.into_iter().map(of).collect(),
        initial: initial.into_iter().map(|(variable, value)| (of(variable), of(value))).collect(),
        ..Shader::default()
    };
    for (variable, role) in roles {
        let id = of(variable);
        if role.is_passed() {
            check_passed(linker, id)?;
        }
        match role {
            Role::BuiltIn(builtin) => shader.builtins.push((builtin, id)),
            Role::Input(builtin) => shader.inputs.push((id, declare_input(linker, builtin, id))),
            Role::IncomingPayload => shader.incoming_payload = Some(id),
            Role::IncomingCallable => shader.incoming_callable = Some(id),
            Role::Attributes => shader.attributes = Some(id),
            Role::Record => shader.record = Some(id),
            Role::Push => shader.push = Some(id),
            Role::TlasTable => shader.tlas_tables.push(id),
            Role::Outgoing | Role::Own => shader.own.push(id),
            Role::Shared => {}
        }
    }
    Ok(shader)
}

/// Fails for modules that need other hardware of ray tracing pipelines, for those of the Vulkan memory model (the traversal
/// that they are linked with has the other model, and a module has one), and for blocks of buffers that are payloads too.
fn check_module(module: &Module) -> Result<(), String> {
    let refused = [
        Capability::ShaderInvocationReorderNV,
        Capability::RayTracingMotionBlurNV,
        Capability::RayTracingOpacityMicromapEXT,
        Capability::RayTracingDisplacementMicromapNV,
        Capability::VulkanMemoryModel,
    ];
    let found = refused.iter().find(|capability| module.capabilities.contains(&(**capability as u32)));
    if let Some(capability) = found {
        return Err(format!("OpCapability {capability:?} cannot be lowered"));
    }
    let [of_payloads, of_others] = [true, false].map(|is_converted| pointees(module, is_converted));
    let is_shared = |ty: &u32| of_others.contains(ty) && block_decoration(module, *ty).is_some();
    match of_payloads.iter().find(|ty| is_shared(ty)) {
        Some(ty) => Err(format!(
            "OpTypeStruct %{ty} is the block of a buffer and the type of a payload, callable data or attributes; declare two types"
        )),
        None => Ok(()),
    }
}

/// Fails for an instruction of ray tracing that the stage does not have: lowered, it would be a call in a circle, or stay in the module.
fn check_instructions(module: &Module, stage: ShaderStage) -> Result<(), String> {
    use ShaderStage::{AnyHit, Callable, ClosestHit, Intersection, Miss, RayGen};
    let mut code = module.functions.iter().flat_map(Function::code);
    let is_allowed = |op| match op {
        Op::TraceRayKHR => matches!(stage, RayGen | ClosestHit | Miss),
        Op::ExecuteCallableKHR => matches!(stage, RayGen | ClosestHit | Miss | Callable),
        Op::ReportIntersectionKHR => stage == Intersection,
        Op::IgnoreIntersectionKHR | Op::TerminateRayKHR => stage == AnyHit,
        _ => true,
    };
    match code.find(|inst| !is_allowed(inst.op)) {
        Some(inst) => Err(format!("Op{:?} is not allowed in a shader of the stage {stage:?}", inst.op)),
        None => Ok(()),
    }
}

/// Fails for a variable whose type cannot be compared with the type on the other side. The error is a message.
fn check_passed(linker: &Linker, variable: u32) -> Result<(), String> {
    let ty = linker.variable_type(variable).unwrap_or(0);
    let what = "OpVariable of a payload, callable data or attributes has";
    match linker.value_count(ty) {
        None => Err(format!("{what} an array whose length is not known, or a type that contains itself")),
        Some(count) if count > MAX_PASSED => {
            Err(format!("{what} {count} values; at most {MAX_PASSED} are passed"))
        }
        Some(_) => Ok(()),
    }
}

/// An entry point.
struct Entry {
    function: u32,
    /// Variables that its functions use; `None` for the only entry point of a module.
    interface: Option<HashSet<u32>>,
}

/// Returns the execution model of a stage of ray tracing pipelines.
pub(super) fn execution_model(stage: ShaderStage) -> ExecutionModel {
    match stage {
        ShaderStage::RayGen => ExecutionModel::RayGenerationKHR,
        ShaderStage::Miss => ExecutionModel::MissKHR,
        ShaderStage::ClosestHit => ExecutionModel::ClosestHitKHR,
        ShaderStage::AnyHit => ExecutionModel::AnyHitKHR,
        ShaderStage::Intersection => ExecutionModel::IntersectionKHR,
        _ => ExecutionModel::CallableKHR,
    }
}

/// Takes the entry points and their modes out, with the functions that its own does not reach, and returns that of the stage.
fn take_entry(module: &mut Module, stage: ShaderStage) -> Result<Entry, String> {
    let model = execution_model(stage);
    let entries = std::mem::take(&mut module.entry_points);
    module.modes.clear();
    let is_main = |entry: &&Inst| {
        entry.operand(0) == model as u32
            && entry.operands.get(2..4) == Some(&[u32::from_le_bytes(*b"main"), 0])
    };
    let entry = entries.iter().find(is_main).ok_or("there is no entry point 'main' of the stage")?;
    let function = entry.operand(1);
    keep_called(module, function);
    if entries.len() == 1 {
        return Ok(Entry { function, interface: None });
    }
    let interface = entry.operands.get(4..).unwrap_or(&[]).iter().copied().collect();
    Ok(Entry { function, interface: Some(interface) })
}

/// Removes the functions that `entry` does not reach.
fn keep_called(module: &mut Module, entry: u32) {
    let mut called = HashSet::from([entry]);
    loop {
        let callers = module.functions.iter().filter(|function| called.contains(&function.id()));
        let calls = callers.flat_map(Function::code).filter(|inst| inst.op == Op::FunctionCall);
        let found: HashSet<u32> = calls.map(|inst| inst.operand(2)).chain(called.iter().copied()).collect();
        if found.len() == called.len() {
            break;
        }
        called = found;
    }
    module.functions.retain(|function| called.contains(&function.id()));
}

fn roles(module: &Module, entry: &Entry) -> Vec<(u32, Role)> {
    let decoration = |id: u32, which: Decoration| {
        let is_it = |inst: &&Inst| {
            inst.op == Op::Decorate && inst.operand(0) == id && inst.operand(1) == which as u32
        };
        module.decorations.iter().find(is_it).map(|inst| inst.operand(2))
    };
    let role = |inst: &Inst| {
        let id = inst.operand(1);
        if entry.interface.as_ref().is_some_and(|interface| !interface.contains(&id)) {
            return (id, Role::Shared);
        }
        let builtin = decoration(id, Decoration::BuiltIn).and_then(BuiltIn::from_u32);
        let role = match (StorageClass::from_u32(inst.operand(2)), builtin) {
            (Some(StorageClass::Input), Some(builtin)) if is_of_rays(builtin) => Role::BuiltIn(builtin),
            (Some(StorageClass::Input), Some(builtin)) => Role::Input(builtin),
            (Some(StorageClass::IncomingRayPayloadKHR), _) => Role::IncomingPayload,
            (Some(StorageClass::IncomingCallableDataKHR), _) => Role::IncomingCallable,
            (Some(StorageClass::HitAttributeKHR), _) => Role::Attributes,
            (Some(StorageClass::ShaderRecordBufferKHR), _) => Role::Record,
            (Some(StorageClass::PushConstant), _) => Role::Push,
            (Some(StorageClass::RayPayloadKHR | StorageClass::CallableDataKHR), _) => Role::Outgoing,
            (Some(StorageClass::Private), _) => Role::Own,
            (Some(StorageClass::StorageBuffer), _)
                if decoration(id, Decoration::DescriptorSet) == Some(layout::SET)
                    && decoration(id, Decoration::Binding) == Some(layout::TLAS_TABLE) =>
            {
                Role::TlasTable
            }
            _ => Role::Shared,
        };
        (id, role)
    };
    module.globals.iter().filter(|inst| inst.op == Op::Variable).map(role).collect()
}

/// True for values that the library provides; the others are inputs of a compute shader too.
fn is_of_rays(builtin: BuiltIn) -> bool {
    matches!(
        builtin,
        BuiltIn::CullMaskKHR
            | BuiltIn::HitKindKHR
            | BuiltIn::HitTNV
            | BuiltIn::HitTriangleVertexPositionsKHR
            | BuiltIn::IncomingRayFlagsKHR
            | BuiltIn::InstanceCustomIndexKHR
            | BuiltIn::InstanceId
            | BuiltIn::LaunchIdKHR
            | BuiltIn::LaunchSizeKHR
            | BuiltIn::ObjectRayDirectionKHR
            | BuiltIn::ObjectRayOriginKHR
            | BuiltIn::ObjectToWorldKHR
            | BuiltIn::PrimitiveId
            | BuiltIn::RayGeometryIndexKHR
            | BuiltIn::RayTmaxKHR
            | BuiltIn::RayTminKHR
            | BuiltIn::WorldRayDirectionKHR
            | BuiltIn::WorldRayOriginKHR
            | BuiltIn::WorldToObjectKHR
    )
}

/// Takes the initial values of variables out, as a shader starts more than once in an invocation.
fn take_initial_values(module: &mut Module) -> Vec<(u32, u32)> {
    let mut taken = Vec::new();
    for inst in module.globals.iter_mut().filter(|inst| inst.op == Op::Variable) {
        if inst.operands.len() > 3 {
            taken.push((inst.operand(1), inst.operand(3)));
            inst.operands.truncate(3);
        }
    }
    taken
}

/// Makes functions store the initial values of their variables where they start, as a function that waits for rays starts more than
/// once in an invocation.
fn store_initial_values(module: &mut Module) {
    for code in
        module.functions.iter_mut().filter_map(|function| Some(&mut function.blocks.first_mut()?.code))
    {
        let mut stores = Vec::new();
        for inst in code.iter_mut().filter(|inst| inst.op == Op::Variable && inst.operands.len() > 3) {
            stores.push(Inst::new(Op::Store, &[inst.operand(1), inst.operand(3)]));
            inst.operands.truncate(3);
        }
        let behind = code.iter().rposition(|inst| inst.op == Op::Variable).map_or(0, |last| last + 1);
        code.splice(behind..behind, stores);
    }
}

/// Gives pointers and variables the storage classes of the compute shader, and removes what decorated the old ones.
fn convert_storage(module: &mut Module) {
    remove_block_decorations(module);
    for inst in &mut module.globals {
        let at = match inst.op {
            Op::TypePointer => 1,
            Op::Variable => 2,
            _ => continue,
        };
        if let Some(storage) = inst.operands.get_mut(at) {
            *storage = converted_storage(*storage);
        }
    }
    let converted: HashSet<u32> = module
        .globals
        .iter()
        .filter(|inst| {
            let storage = [StorageClass::Private, StorageClass::PhysicalStorageBuffer];
            inst.op == Op::Variable && storage.iter().any(|class| *class as u32 == inst.operand(2))
        })
        .map(|inst| inst.operand(1))
        .collect();
    let gone = [Decoration::BuiltIn, Decoration::Location, Decoration::Flat, Decoration::Volatile];
    module.decorations.retain(|inst| {
        let is_gone = gone.iter().any(|decoration| *decoration as u32 == inst.operand(1));
        inst.op != Op::Decorate || !is_gone || !converted.contains(&inst.operand(0))
    });
}

/// Makes conditional branches with one target plain branches: SPIR-V 1.6, of which lowered modules are, allows no others.
fn join_equal_branches(module: &mut Module) {
    for block in module.functions.iter_mut().flat_map(|function| &mut function.blocks) {
        let is_equal =
            |inst: &mut Inst| inst.op == Op::BranchConditional && inst.operand(1) == inst.operand(2);
        if let Some(branch) = block.code.pop_if(is_equal) {
            let _ = block.code.pop_if(|inst| inst.op == Op::SelectionMerge);
            block.code.push(Inst::new(Op::Branch, &[branch.operand(1)]));
        }
    }
}

/// Makes the blocks of payloads, callable data and attributes plain structs: variables of the invocation have no layout.
fn remove_block_decorations(module: &mut Module) {
    let blocks = pointees(module, true);
    module.decorations.retain(|inst| !is_block(inst) || !blocks.contains(&inst.operand(0)));
}

/// Returns the types that pointers lead to: those of payloads, callable data and attributes, which become variables of the
/// invocation, or all others.
fn pointees(module: &Module, is_passed: bool) -> BTreeSet<u32> {
    let becomes_private = |storage: u32| {
        storage != StorageClass::Input as u32 && converted_storage(storage) == StorageClass::Private as u32
    };
    let pointers = module.globals.iter().filter(|inst| inst.op == Op::TypePointer);
    let wanted = pointers.filter(|inst| becomes_private(inst.operand(1)) == is_passed);
    wanted.map(|inst| inst.operand(2)).collect()
}

fn is_block(inst: &Inst) -> bool {
    inst.op == Op::Decorate && inst.operand(1) == Decoration::Block as u32
}

/// Returns the decoration of a type that is a block.
fn block_decoration(module: &Module, ty: u32) -> Option<&Inst> {
    module.decorations.iter().find(|inst| is_block(inst) && inst.operand(0) == ty)
}

fn converted_storage(storage: u32) -> u32 {
    let private = [
        StorageClass::Input,
        StorageClass::RayPayloadKHR,
        StorageClass::IncomingRayPayloadKHR,
        StorageClass::HitAttributeKHR,
        StorageClass::CallableDataKHR,
        StorageClass::IncomingCallableDataKHR,
    ];
    if private.iter().any(|class| *class as u32 == storage) {
        StorageClass::Private as u32
    } else if storage == StorageClass::ShaderRecordBufferKHR as u32 {
        StorageClass::PhysicalStorageBuffer as u32
    } else {
        storage
    }
}

/// Declares the input of the compute shader from which a variable takes its value.
fn declare_input(linker: &mut Linker, builtin: BuiltIn, variable: u32) -> u32 {
    let ty = linker.variable_type(variable).unwrap_or(0);
    linker.input(builtin, ty)
}

#[cfg(test)]
mod tests {
    use super::super::module::Block;
    use super::*;

    #[test]
    fn branches_to_one_target_have_no_condition() {
        const CONDITION: u32 = 7;
        let block = |ends: &[Inst]| Block { label: 1, code: ends.to_vec() };
        let branch = |yes, no| Inst::new(Op::BranchConditional, &[CONDITION, yes, no]);
        let (merge, head) = (Inst::new(Op::SelectionMerge, &[9, 0]), Inst::new(Op::LoopMerge, &[9, 8, 0]));
        let blocks = vec![
            block(&[merge.clone(), branch(9, 9)]),
            block(&[head.clone(), branch(5, 5)]),
            block(&[merge.clone(), branch(5, 9)]),
        ];
        let function =
            Function { head: Inst::new(Op::Function, &[2, 3, 0, 4]), parameters: Vec::new(), blocks };
        let mut module = Module { functions: vec![function], ..Module::default() };
        join_equal_branches(&mut module);
        let code: Vec<&[Inst]> = module.functions[0].blocks.iter().map(|block| &*block.code).collect();
        let plain = |to| Inst::new(Op::Branch, &[to]);
        assert_eq!(code, [&[plain(9)][..], &[head, plain(5)], &[merge, branch(5, 9)]]);
    }

    #[test]
    fn a_block_of_a_buffer_and_of_a_payload_is_refused() {
        let pointer = |id, class: StorageClass, ty| Inst::new(Op::TypePointer, &[id, class as u32, ty]);
        let block = |ty| Inst::new(Op::Decorate, &[ty, Decoration::Block as u32]);
        let module = |classes: &[(StorageClass, u32)]| Module {
            globals: (10..).zip(classes).map(|(id, (class, ty))| pointer(id, *class, *ty)).collect(),
            decorations: vec![block(1), block(2)],
            ..Module::default()
        };
        let (buffer, payload) = (StorageClass::StorageBuffer, StorageClass::RayPayloadKHR);
        assert_eq!(check_module(&module(&[(buffer, 1), (payload, 2), (payload, 3), (buffer, 3)])), Ok(()));
        let refused = check_module(&module(&[(buffer, 1), (payload, 1)]));
        assert!(refused.is_err_and(|message| message.starts_with("OpTypeStruct %1 ")));
    }
}
