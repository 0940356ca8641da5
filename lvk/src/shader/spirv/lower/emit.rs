//! Writes code into a list of instructions.

use ::spirv::Op;

use super::instruction::Inst;
use super::linker::Linker;

/// Appends instructions to `code`, with new ids of the linked module.
pub(super) struct Emitter<'a> {
    pub(super) linker: &'a mut Linker,
    pub(super) code: &'a mut Vec<Inst>,
}

impl<'a> Emitter<'a> {
    pub(super) fn new(linker: &'a mut Linker, code: &'a mut Vec<Inst>) -> Self {
        Self { linker, code }
    }

    pub(super) fn push(&mut self, op: Op, operands: &[u32]) {
        self.code.push(Inst::new(op, operands));
    }

    /// Appends an instruction with a result, and returns the result.
    pub(super) fn value(&mut self, op: Op, ty: u32, operands: &[u32]) -> u32 {
        let id = self.linker.new_id();
        let words: Vec<u32> = [ty, id].iter().chain(operands).copied().collect();
        self.code.push(Inst::new(op, &words));
        id
    }

    /// Loads a variable of the invocation.
    pub(super) fn load(&mut self, variable: u32) -> u32 {
        let ty = self.linker.variable_type(variable).unwrap_or(0);
        self.value(Op::Load, ty, &[variable])
    }

    pub(super) fn store(&mut self, variable: u32, value: u32) {
        self.push(Op::Store, &[variable, value]);
    }

    /// Stores a number in a variable of type `uint`.
    pub(super) fn store_number(&mut self, variable: u32, number: u32) {
        let value = self.linker.constant(number);
        self.store(variable, value);
    }

    /// Makes a variable of the invocation undefined, so that compilers keep it in no register.
    pub(super) fn forget(&mut self, variable: u32) {
        let ty = self.linker.variable_type(variable).unwrap_or(0);
        self.store_undefined(variable, ty);
    }

    /// Stores a value of the type that may be any.
    pub(super) fn store_undefined(&mut self, pointer: u32, ty: u32) {
        let undefined = self.linker.undefined(ty);
        self.store(pointer, undefined);
    }

    /// Converts a value to a type of the same shape, bit by bit.
    pub(super) fn convert(&mut self, value: u32, from: u32, to: u32) -> u32 {
        if from == to {
            return value;
        }
        let (Some(parts), Some(wanted)) = (self.linker.member_types(from), self.linker.member_types(to))
        else {
            return self.value(Op::Bitcast, to, &[value]);
        };
        let pairs = (0..).zip(parts.into_iter().zip(wanted));
        let members: Vec<u32> = pairs
            .map(|(index, (from, to))| {
                let member = self.value(Op::CompositeExtract, from, &[value, index]);
                self.convert(member, from, to)
            })
            .collect();
        self.value(Op::CompositeConstruct, to, &members)
    }

    /// Returns an index as `uint`, from an integer type of any size.
    pub(super) fn index(&mut self, value: u32, ty: u32) -> u32 {
        const BITS: u32 = 32;
        let uint = self.linker.uint();
        if self.linker.global(ty).is_some_and(|inst| inst.op == Op::TypeInt && inst.operand(1) != BITS) {
            return self.value(Op::UConvert, uint, &[value]);
        }
        self.convert(value, ty, uint)
    }

    /// Copies one variable to another one, whose type has the same shape.
    pub(super) fn copy(&mut self, from: u32, to: u32) {
        if from == to {
            return;
        }
        let types = [from, to].map(|variable| self.linker.variable_type(variable).unwrap_or(0));
        let value = self.load(from);
        let value = self.convert(value, types[0], types[1]);
        self.store(to, value);
    }

    /// Calls a function without parameters and result.
    pub(super) fn call(&mut self, function: u32) {
        let void = self.linker.void();
        self.value(Op::FunctionCall, void, &[function]);
    }
}
