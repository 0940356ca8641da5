//! Gives functions the index of an acceleration structure in `kTLAS` in place of the structure itself.

use std::collections::HashMap;

use ::spirv::{Decoration, Op, StorageClass};

use super::emit::Emitter;
use super::instruction::Inst;
use super::linker::Linker;
use super::module::Function;
use crate::shader::spirv::parsed::MAX_NESTING;

/// An element of an array of acceleration structures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Element {
    /// The array, a variable.
    pub(super) array: u32,
    /// A value of an integer type.
    pub(super) index: u32,
}

/// Replaces the parameters of a shader's functions that are elements of `kTLAS` in all calls.
pub(super) fn pass_indices(linker: &mut Linker, functions: &[u32]) {
    // A function whose own parameter is replaced can pass the element on, so each round may allow another one.
    while let Some(parameter) = functions.iter().find_map(|id| replaceable(linker, functions, *id)) {
        replace_in_calls(linker, functions, &parameter);
        replace_in_function(linker, &parameter);
    }
}

/// A parameter to be replaced.
struct Parameter {
    function: u32,
    /// The place among the function's parameters.
    place: usize,
    /// The array of all elements that are passed.
    array: u32,
    /// True if an element is not the same for all invocations that run together.
    is_non_uniform: bool,
}

/// Returns a parameter of the function that is an element of the same array in all calls.
fn replaceable(linker: &Linker, functions: &[u32], function: u32) -> Option<Parameter> {
    let parameters = &linker.function(function)?.parameters;
    let places = (0..parameters.len()).filter(|place| is_structure(linker, parameters[*place].operand(0)));
    places.into_iter().find_map(|place| {
        let mut arguments = Vec::new();
        for caller in functions.iter().filter_map(|id| linker.function(*id)) {
            let definitions = caller.definitions();
            for call in caller.code().filter(|inst| is_call(inst, function)) {
                let argument = call.operand(3 + place);
                arguments.push((argument, element_of(linker, &definitions, argument)?));
            }
        }
        let (_, Element { array, .. }) = *arguments.first()?;
        let is_non_uniform = arguments.iter().any(|(argument, _)| is_non_uniform(linker, *argument));
        let is_one = arguments.iter().all(|(_, element)| element.array == array);
        is_one.then_some(Parameter { function, place, array, is_non_uniform })
    })
}

/// True for the type of an acceleration structure, and for pointers to one.
fn is_structure(linker: &Linker, ty: u32) -> bool {
    let inner = linker.pointer(ty).map_or(ty, |(_, target)| target);
    linker.global(inner).is_some_and(|inst| inst.op == Op::TypeAccelerationStructureKHR)
}

fn is_call(inst: &Inst, function: u32) -> bool {
    inst.op == Op::FunctionCall && inst.operand(2) == function
}

fn is_non_uniform(linker: &Linker, id: u32) -> bool {
    let decorations = &linker.module.decorations;
    decorations
        .iter()
        .any(|inst| inst.op == Op::Decorate && inst.operands == [id, Decoration::NonUniform as u32])
}

/// Returns the element that a structure, or a pointer to one, is; `None` for other structures.
pub(super) fn element_of(
    linker: &Linker,
    definitions: &HashMap<u32, Inst>,
    structure: u32,
) -> Option<Element> {
    let mut inst = definitions.get(&structure)?;
    for _ in 0..MAX_NESTING {
        if !matches!(inst.op, Op::CopyObject | Op::Load) {
            break;
        }
        inst = definitions.get(&inst.operand(2))?;
    }
    let is_chain = matches!(inst.op, Op::AccessChain | Op::InBoundsAccessChain) && inst.operands.len() == 4;
    let element = Element { array: inst.operand(2), index: inst.operand(3) };
    (is_chain && linker.global(element.array).is_some()).then_some(element)
}

fn replace_in_calls(linker: &mut Linker, functions: &[u32], parameter: &Parameter) {
    for id in functions {
        let Some(mut caller) = linker.take_function(*id) else { continue };
        let definitions = caller.definitions();
        for block in &mut caller.blocks {
            let mut out = Vec::with_capacity(block.code.len());
            for mut inst in std::mem::take(&mut block.code) {
                if is_call(&inst, parameter.function)
                    && let Some(argument) = inst.operands.get_mut(3 + parameter.place)
                    && let Some(Element { index, .. }) = element_of(linker, &definitions, *argument)
                {
                    let ty = linker.value_type(&definitions, index);
                    *argument = Emitter::new(linker, &mut out).index(index, ty);
                }
                out.push(inst);
            }
            block.code = out;
        }
        linker.module.functions.push(caller);
    }
}

/// Makes the parameter an index, and what it was before the element with this index.
fn replace_in_function(linker: &mut Linker, parameter: &Parameter) {
    let Some(mut function) = linker.take_function(parameter.function) else { return };
    let Parameter { place, array, .. } = *parameter;
    let (uint, index) = (linker.uint(), linker.new_id());
    let old =
        std::mem::replace(&mut function.parameters[place], Inst::new(Op::FunctionParameter, &[uint, index]));
    let (ty, structure) = (old.operand(0), old.operand(1));
    let mut code = Vec::new();
    let mut emitter = Emitter::new(linker, &mut code);
    if emitter.linker.pointer(ty).is_some() {
        emitter.push(Op::AccessChain, &[ty, structure, array, index]);
    } else {
        let pointer = emitter.linker.pointer_to(StorageClass::UniformConstant, ty);
        let element = emitter.value(Op::AccessChain, pointer, &[array, index]);
        emitter.push(Op::Load, &[ty, structure, element]);
    }
    if parameter.is_non_uniform {
        let decoration = [structure, Decoration::NonUniform as u32];
        linker.module.decorations.push(Inst::new(Op::Decorate, &decoration));
    }
    insert_behind_variables(&mut function, code);
    let result = function.head.operand(0);
    let types: Vec<u32> = function.parameters.iter().map(|inst| inst.operand(0)).collect();
    function.head.operands[3] = linker.function_type(result, &types);
    linker.module.functions.push(function);
}

fn insert_behind_variables(function: &mut Function, mut code: Vec<Inst>) {
    let Some(first) = function.blocks.first_mut() else { return };
    let rest = first.take_code_behind_variables();
    code.extend(rest);
    first.code.extend(code);
}
