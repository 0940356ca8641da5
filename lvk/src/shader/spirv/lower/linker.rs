//! Links modules into one, and declares types, constants and variables in it.

use std::collections::{HashMap, HashSet};

use ::spirv::{BuiltIn, Decoration, Op, StorageClass};

use super::instruction::{Inst, UnknownOpcode, for_each_id};
use super::module::{Block, Function, Module};
use crate::shader::spirv::parsed::MAX_NESTING;

/// New ids by the ids of a module that has been linked.
pub(super) type IdMap = HashMap<u32, u32>;

/// Values of a payload, callable data or attributes at most, as these may be converted value by value. A vector or matrix
/// counts as one.
pub(super) const MAX_PASSED: u32 = 4096;

/// The linked module.
#[derive(Default)]
pub(super) struct Linker {
    pub(super) module: Module,
    /// Types and constants that are declared once, by opcode, operands without the result, and decorations.
    unique: HashMap<(u32, Vec<u32>), u32>,
    /// Types, constants and variables by their ids.
    globals: HashMap<u32, Inst>,
    /// Shapes of types with the numbers of their values, and the types that stand for shapes.
    shapes: HashMap<u32, (u32, u32)>,
    shape_keys: HashMap<Vec<u32>, u32>,
    /// Inputs by built-in value and type.
    inputs: HashMap<u32, u32>,
}

impl Linker {
    pub(super) fn new(version: u32) -> Self {
        let module = Module { version, bound: 1, ..Module::default() };
        Self { module, ..Self::default() }
    }

    /// Adds all of a module but its entry points and their modes. Returns the new ids.
    pub(super) fn link(&mut self, module: Module) -> Result<IdMap, UnknownOpcode> {
        let decorations = decoration_words(&module);
        let wide = module.wide;
        let mut ids = IdMap::new();
        let mut shared = HashSet::new();
        for import in module.imports {
            self.link_import(import, &mut ids);
        }
        for mut string in module.strings {
            self.map_ids(&mut string, &wide, &mut ids)?;
            self.module.strings.push(string);
        }
        for global in module.globals {
            let old = global.result();
            if self.link_global(global, &decorations, &wide, &mut ids)? {
                shared.extend(old);
            }
        }
        for mut function in module.functions {
            let parts = std::iter::once(&mut function.head).chain(&mut function.parameters);
            for inst in parts {
                self.map_ids(inst, &wide, &mut ids)?;
            }
            for Block { label, code } in &mut function.blocks {
                *label = self.map_id(*label, &mut ids);
                for inst in code {
                    self.map_ids(inst, &wide, &mut ids)?;
                }
            }
            self.module.functions.push(function);
        }
        for mut inst in module.decorations.into_iter().filter(|inst| !shared.contains(&inst.operand(0))) {
            self.map_ids(&mut inst, &wide, &mut ids)?;
            self.module.decorations.push(inst);
        }
        for (id, name) in module.names {
            if let Some(id) = ids.get(&id) {
                self.module.names.insert(*id, name);
            }
        }
        self.module.wide.extend(wide.iter().filter_map(|id| ids.get(id)));
        add_new(&mut self.module.capabilities, module.capabilities);
        add_new(&mut self.module.extensions, module.extensions);
        Ok(ids)
    }

    fn link_import(&mut self, import: Inst, ids: &mut IdMap) {
        let name = &import.operands[1..];
        let known = self.module.imports.iter().find(|own| &own.operands[1..] == name);
        if let Some(known) = known {
            ids.insert(import.operand(0), known.operand(0));
            return;
        }
        let mut import = import;
        let id = self.map_id(import.operand(0), ids);
        import.set_result(id);
        self.module.imports.push(import);
    }

    /// Returns true if the module has the type or constant already.
    fn link_global(
        &mut self,
        mut inst: Inst,
        decorations: &HashMap<u32, Vec<u32>>,
        wide: &HashSet<u32>,
        ids: &mut IdMap,
    ) -> Result<bool, UnknownOpcode> {
        let old = inst.result();
        let is_forward = old.is_some_and(|old| ids.contains_key(&old));
        self.map_ids(&mut inst, wide, ids)?;
        let Some(old) = old else {
            self.module.globals.push(inst);
            return Ok(false);
        };
        let Some(id) = ids.get(&old).copied() else { return Err(UnknownOpcode(inst.op)) };
        // Others may refer to a pointer that was declared before its target.
        let can_share = is_unique(inst.op) && (!is_forward || self.take_unused_declaration(id));
        if can_share {
            let key = unique_key(&inst, decorations.get(&old).map_or(&[][..], Vec::as_slice));
            if let Some(known) = self.unique.get(&key) {
                ids.insert(old, *known);
                return Ok(true);
            }
            self.unique.insert(key, id);
        }
        self.push_global(inst);
        Ok(false)
    }

    /// Removes the forward declaration of a pointer type that nothing refers to. Returns false if something does.
    fn take_unused_declaration(&mut self, pointer: u32) -> bool {
        let is_declaration = |inst: &Inst| inst.op == Op::TypeForwardPointer && inst.operand(0) == pointer;
        let refers = |inst: &Inst| !is_declaration(inst) && inst.operands.contains(&pointer);
        let Some(at) = self.module.globals.iter().position(is_declaration) else { return false };
        if self.module.globals[at..].iter().any(refers) {
            return false;
        }
        self.module.globals.remove(at);
        true
    }

    fn map_ids(
        &mut self,
        inst: &mut Inst,
        wide: &HashSet<u32>,
        ids: &mut IdMap,
    ) -> Result<(), UnknownOpcode> {
        for_each_id(inst, wide, |id| *id = self.map_id(*id, ids))
    }

    fn map_id(&mut self, id: u32, ids: &mut IdMap) -> u32 {
        *ids.entry(id).or_insert_with(|| self.module.new_id())
    }

    fn push_global(&mut self, inst: Inst) {
        if let Some(id) = inst.result() {
            self.globals.insert(id, inst.clone());
        }
        self.module.globals.push(inst);
    }

    pub(super) fn new_id(&mut self) -> u32 {
        self.module.new_id()
    }

    /// Returns a type, constant or variable.
    pub(super) fn global(&self, id: u32) -> Option<&Inst> {
        self.globals.get(&id)
    }

    /// Returns the type of a value, of which `definitions` has those of its function, or of a constant.
    pub(super) fn value_type(&self, definitions: &HashMap<u32, Inst>, value: u32) -> u32 {
        let inst = definitions.get(&value).or_else(|| self.global(value));
        inst.and_then(Inst::result_type).unwrap_or(0)
    }

    /// Returns the storage class and the target of a pointer type.
    pub(super) fn pointer(&self, ty: u32) -> Option<(u32, u32)> {
        let inst = self.global(ty).filter(|inst| inst.op == Op::TypePointer)?;
        Some((inst.operand(1), inst.operand(2)))
    }

    /// Returns the type behind the pointer that a variable is.
    pub(super) fn variable_type(&self, variable: u32) -> Option<u32> {
        let inst = self.global(variable).filter(|inst| inst.op == Op::Variable)?;
        self.pointer(inst.operand(0)).map(|(_, target)| target)
    }

    /// Declares a type or a constant that is declared once. `operands` leave out the result.
    fn declare(&mut self, op: Op, operands: &[u32]) -> u32 {
        let key = (op as u32, operands.to_vec());
        if let Some(known) = self.unique.get(&key) {
            return *known;
        }
        let id = self.new_id();
        let at = if is_type(op) { 0 } else { 1 };
        let mut words = operands.to_vec();
        words.insert(at, id);
        self.unique.insert(key, id);
        self.push_global(Inst::new(op, &words));
        id
    }

    pub(super) fn void(&mut self) -> u32 {
        self.declare(Op::TypeVoid, &[])
    }

    pub(super) fn bool(&mut self) -> u32 {
        self.declare(Op::TypeBool, &[])
    }

    pub(super) fn uint(&mut self) -> u32 {
        self.declare(Op::TypeInt, &[32, 0])
    }

    pub(super) fn uvec2(&mut self) -> u32 {
        let uint = self.uint();
        self.declare(Op::TypeVector, &[uint, 2])
    }

    pub(super) fn array(&mut self, element: u32, length: u32) -> u32 {
        let length = self.constant(length);
        self.declare(Op::TypeArray, &[element, length])
    }

    pub(super) fn pointer_to(&mut self, storage: StorageClass, target: u32) -> u32 {
        self.declare(Op::TypePointer, &[storage as u32, target])
    }

    /// Declares a block for push constants: the members of a block, and a pair of numbers at `offset`. Returns the
    /// variable, and the index of the pair.
    pub(super) fn push_block(&mut self, members_of: Option<u32>, offset: u32) -> (u32, u32) {
        let pair = self.uvec2();
        let members = members_of.and_then(|ty| self.global(ty)).map_or(&[][..], |inst| &inst.operands[1..]);
        let mut words = members.to_vec();
        let index = words.len() as u32;
        let ty = self.new_id();
        words.insert(0, ty);
        words.push(pair);
        self.push_global(Inst::new(Op::TypeStruct, &words));
        if let Some(from) = members_of {
            self.copy_decorations(&IdMap::from([(from, ty)]));
        } else {
            self.module.decorations.push(Inst::new(Op::Decorate, &[ty, Decoration::Block as u32]));
        }
        let place = [ty, index, Decoration::Offset as u32, offset];
        self.module.decorations.push(Inst::new(Op::MemberDecorate, &place));
        let storage = StorageClass::PushConstant;
        let pointer = self.pointer_to(storage, ty);
        let variable = self.new_id();
        self.push_global(Inst::new(Op::Variable, &[pointer, variable, storage as u32]));
        (variable, index)
    }

    /// Declares the type of functions without parameters that return nothing.
    pub(super) fn plain_function_type(&mut self) -> u32 {
        let void = self.void();
        self.function_type(void, &[])
    }

    pub(super) fn function_type(&mut self, result: u32, parameters: &[u32]) -> u32 {
        self.declare(Op::TypeFunction, &[&[result], parameters].concat())
    }

    pub(super) fn constant(&mut self, value: u32) -> u32 {
        let uint = self.uint();
        self.declare(Op::Constant, &[uint, value])
    }

    /// Declares a constant of a type of numbers, by its words.
    pub(super) fn constant_of(&mut self, ty: u32, words: &[u32]) -> u32 {
        self.declare(Op::Constant, &[&[ty], words].concat())
    }

    pub(super) fn bool_constant(&mut self, value: bool) -> u32 {
        let bool = self.bool();
        self.declare(if value { Op::ConstantTrue } else { Op::ConstantFalse }, &[bool])
    }

    pub(super) fn null(&mut self, ty: u32) -> u32 {
        self.declare(Op::ConstantNull, &[ty])
    }

    /// Notes a new value of a 64-bit integer type, on which the length of a switch's literals depends.
    pub(super) fn mark_wide(&mut self, id: u32, ty: u32) {
        if self.global(ty).is_some_and(|inst| inst.op == Op::TypeInt && inst.operand(1) == 64) {
            self.module.wide.insert(id);
        }
    }

    /// Returns a value of the type that may be any.
    pub(super) fn undefined(&mut self, ty: u32) -> u32 {
        self.declare(Op::Undef, &[ty])
    }

    /// Declares a variable of the invocation.
    pub(super) fn private(&mut self, ty: u32) -> u32 {
        let pointer = self.pointer_to(StorageClass::Private, ty);
        let id = self.new_id();
        self.push_global(Inst::new(Op::Variable, &[pointer, id, StorageClass::Private as u32]));
        self.decorate_pointer_variable(id, ty);
        id
    }

    /// Decorates a variable as Vulkan wants it if the variable holds pointers to buffers.
    pub(super) fn decorate_pointer_variable(&mut self, variable: u32, ty: u32) {
        if self.holds_buffer_pointers(ty) {
            let aliased = Decoration::AliasedPointer as u32;
            self.module.decorations.push(Inst::new(Op::Decorate, &[variable, aliased]));
        }
    }

    /// True if variables of the type can be loaded and stored.
    pub(super) fn can_store(&self, ty: u32) -> bool {
        let element = self.innermost_element(ty);
        let Some(inst) = self.global(element) else { return false };
        match inst.op {
            Op::TypePointer => self.is_buffer_pointer(element),
            Op::TypeImage | Op::TypeSampler | Op::TypeSampledImage => false,
            Op::TypeAccelerationStructureKHR | Op::TypeRayQueryKHR => false,
            _ => true,
        }
    }

    /// Declares an input of the shader, once for a built-in value, as an entry point may have it once. Shaders that declare it by
    /// another type of the same shape convert it.
    pub(super) fn input(&mut self, builtin: BuiltIn, ty: u32) -> u32 {
        if let Some(known) = self.inputs.get(&(builtin as u32)) {
            return *known;
        }
        let pointer = self.pointer_to(StorageClass::Input, ty);
        let id = self.new_id();
        self.push_global(Inst::new(Op::Variable, &[pointer, id, StorageClass::Input as u32]));
        let decoration = [id, Decoration::BuiltIn as u32, builtin as u32];
        self.module.decorations.push(Inst::new(Op::Decorate, &decoration));
        self.inputs.insert(builtin as u32, id);
        id
    }

    /// True for a pointer to a buffer, or an array of them.
    fn holds_buffer_pointers(&self, ty: u32) -> bool {
        self.is_buffer_pointer(self.innermost_element(ty))
    }

    /// True for a pointer to a buffer: an address.
    pub(super) fn is_buffer_pointer(&self, ty: u32) -> bool {
        self.pointer(ty).is_some_and(|(storage, _)| storage == StorageClass::PhysicalStorageBuffer as u32)
    }

    /// Returns the type of the elements of an array of arrays; the type itself if it is no array.
    fn innermost_element(&self, ty: u32) -> u32 {
        let mut element = ty;
        for _ in 0..MAX_NESTING {
            match self.global(element) {
                Some(inst) if inst.op == Op::TypeArray => element = inst.operand(1),
                _ => break,
            }
        }
        element
    }

    /// Returns a type that two types share if one can be converted to the other: the first with members of the same bits.
    /// Numbers of the same size have the same bits, and so have pointers to buffers.
    pub(super) fn shape(&mut self, ty: u32) -> u32 {
        self.counted_shape(ty).0
    }

    /// Returns the number of values of a type that passes from one shader to another, or any number above [`MAX_PASSED`] for
    /// more; `None` for a number that is not known.
    pub(super) fn value_count(&self, ty: u32) -> Option<u32> {
        self.value_count_within(ty, MAX_NESTING)
    }

    /// In a damaged module, a type may contain itself. A struct counts as one value at least, so that the bound ends this.
    fn value_count_within(&self, ty: u32, nesting: u32) -> Option<u32> {
        let nesting = nesting.checked_sub(1)?;
        let inst = self.global(ty)?;
        match inst.op {
            Op::TypeArray => {
                let of_each = self.value_count_within(inst.operand(1), nesting)?;
                Some(of_each.saturating_mul(self.array_length(ty)?))
            }
            Op::TypeStruct => {
                let mut sum = 0_u32;
                for member in &inst.operands[1..] {
                    // More is not allowed, and need not be counted.
                    if sum > MAX_PASSED {
                        break;
                    }
                    sum = sum.saturating_add(self.value_count_within(*member, nesting)?);
                }
                Some(sum.max(1))
            }
            _ => Some(1),
        }
    }

    /// Returns the shape, and the number of values that a conversion moves.
    fn counted_shape(&mut self, ty: u32) -> (u32, u32) {
        if let Some(known) = self.shapes.get(&ty) {
            return *known;
        }
        // In a damaged module, a type may contain itself.
        self.shapes.insert(ty, (ty, 1));
        let Some((key, count)) = self.shape_key(ty).filter(|(_, count)| *count <= MAX_PASSED) else {
            return (ty, 1);
        };
        let shape = *self.shape_keys.entry(key).or_insert(ty);
        self.shapes.insert(ty, (shape, count));
        (shape, count)
    }

    /// Returns words that types of the same shape share, and the number of values; `None` for other types, which have
    /// shapes of their own.
    fn shape_key(&mut self, ty: u32) -> Option<(Vec<u32>, u32)> {
        let inst = self.global(ty)?.clone();
        let (op, members, length) = match inst.op {
            Op::TypeInt | Op::TypeFloat => (Op::TypeInt, &[][..], inst.operand(1)),
            Op::TypePointer if self.is_buffer_pointer(ty) => (inst.op, &[][..], 0),
            Op::TypeVector | Op::TypeMatrix => (inst.op, &inst.operands[1..2], inst.operand(2)),
            Op::TypeStruct => (inst.op, &inst.operands[1..], 1),
            Op::TypeArray => (inst.op, &inst.operands[1..2], self.array_length(ty)?),
            _ => return None,
        };
        let mut key = vec![op as u32, length];
        let mut count = 0_u32;
        for member in members {
            let (shape, values) = self.counted_shape(*member);
            key.push(shape);
            count = count.saturating_add(values);
        }
        // A struct without members counts too: an array of such structs has elements.
        let count = match op {
            Op::TypeStruct => count.max(1),
            Op::TypeArray => count.saturating_mul(length),
            _ => 1,
        };
        Some((key, count))
    }

    /// Returns the number of elements of an array type whose length is a plain constant.
    pub(super) fn array_length(&self, array: u32) -> Option<u32> {
        let length = self.global(array).filter(|inst| inst.op == Op::TypeArray)?.operand(2);
        self.global(length).filter(|inst| inst.op == Op::Constant).map(|inst| inst.operand(2))
    }

    /// Returns the types of the members of a struct or array of a bounded size.
    pub(super) fn member_types(&mut self, ty: u32) -> Option<Vec<u32>> {
        let (_, count) = self.counted_shape(ty);
        let inst = self.global(ty)?;
        match inst.op {
            Op::TypeStruct => Some(inst.operands.get(1..)?.to_vec()),
            Op::TypeArray => {
                let length = self.array_length(ty).filter(|length| *length <= count)?;
                Some(vec![inst.operand(1); length as usize])
            }
            _ => None,
        }
    }

    /// Adds a function without parameters that returns nothing.
    pub(super) fn push_function(&mut self, id: u32, blocks: Vec<Block>) {
        let (void, ty) = (self.void(), self.plain_function_type());
        let head = Inst::new(Op::Function, &[void, id, 0, ty]);
        self.module.functions.push(Function { head, parameters: Vec::new(), blocks });
    }

    pub(super) fn function_mut(&mut self, id: u32) -> Option<&mut Function> {
        self.module.functions.iter_mut().find(|function| function.id() == id)
    }

    pub(super) fn function(&self, id: u32) -> Option<&Function> {
        self.module.functions.iter().find(|function| function.id() == id)
    }

    /// Takes a function out, to be changed and pushed again.
    pub(super) fn take_function(&mut self, id: u32) -> Option<Function> {
        let at = self.module.functions.iter().position(|function| function.id() == id)?;
        Some(self.module.functions.remove(at))
    }
}

/// Adds the items that are not in the list.
pub(super) fn add_new<T: PartialEq>(list: &mut Vec<T>, items: Vec<T>) {
    for item in items {
        if !list.contains(&item) {
            list.push(item);
        }
    }
}

/// Returns the words of the decorations of each type and constant, sorted.
fn decoration_words(module: &Module) -> HashMap<u32, Vec<u32>> {
    let mut all: HashMap<u32, Vec<Vec<u32>>> = HashMap::new();
    for inst in &module.decorations {
        let words = std::iter::once(inst.op as u32).chain(inst.operands.iter().skip(1).copied());
        all.entry(inst.operand(0)).or_default().push(words.collect());
    }
    let joined = |(id, mut list): (u32, Vec<Vec<u32>>)| {
        list.sort_unstable();
        (id, list.concat())
    };
    all.into_iter().map(joined).collect()
}

/// Returns the key of a type or constant: its operands without the result, and its decorations.
fn unique_key(inst: &Inst, decorations: &[u32]) -> (u32, Vec<u32>) {
    let mut operands = inst.operands.clone();
    operands.remove(if is_type(inst.op) { 0 } else { 1 });
    if !decorations.is_empty() {
        operands.push(u32::MAX);
        operands.extend(decorations);
    }
    (inst.op as u32, operands)
}

fn is_type(op: Op) -> bool {
    use Op::{
        TypeAccelerationStructureKHR, TypeArray, TypeBool, TypeFloat, TypeFunction, TypeImage, TypeInt,
        TypeMatrix, TypePointer, TypeRayQueryKHR, TypeRuntimeArray, TypeSampledImage, TypeSampler,
        TypeStruct, TypeVector, TypeVoid,
    };
    matches!(
        op,
        TypeVoid
            | TypeBool
            | TypeInt
            | TypeFloat
            | TypeVector
            | TypeMatrix
            | TypeImage
            | TypeSampler
            | TypeSampledImage
            | TypeArray
            | TypeRuntimeArray
            | TypeStruct
            | TypePointer
            | TypeFunction
            | TypeAccelerationStructureKHR
            | TypeRayQueryKHR
    )
}

/// True for types and constants that are declared once if nothing decorates them.
fn is_unique(op: Op) -> bool {
    let is_constant = matches!(
        op,
        Op::Constant | Op::ConstantTrue | Op::ConstantFalse | Op::ConstantNull | Op::ConstantComposite
    );
    is_type(op) || is_constant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_declared_once_for_all_types() {
        let mut linker = Linker::new(0x0001_0600);
        let uint = linker.uint();
        let int = linker.new_id();
        linker.push_global(Inst::new(Op::TypeInt, &[int, 32, 1]));
        let [first, second] = [uint, int].map(|ty| linker.input(BuiltIn::SubgroupLocalInvocationId, ty));
        assert_eq!(first, second);
        assert_ne!(first, linker.input(BuiltIn::SubgroupSize, uint));
    }

    #[test]
    fn arrays_of_structs_without_members_have_elements() {
        let mut linker = Linker::new(0x0001_0600);
        let [empty, array] = [(); 2].map(|()| linker.new_id());
        let two = linker.constant(2);
        linker.push_global(Inst::new(Op::TypeStruct, &[empty]));
        linker.push_global(Inst::new(Op::TypeArray, &[array, empty, two]));
        assert_eq!(linker.member_types(array), Some(vec![empty; 2]));
        assert_eq!(linker.member_types(empty), Some(Vec::new()));
    }
}
