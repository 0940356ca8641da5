//! Instructions that a pass may change, and the places of ids in them.

use std::collections::HashSet;

use ::spirv::Op;

/// An instruction with its words, the first of which holds the length and the opcode.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Inst {
    pub(super) op: Op,
    /// All words behind the first.
    pub(super) operands: Vec<u32>,
}

impl Inst {
    pub(super) fn new(op: Op, operands: &[u32]) -> Self {
        Self { op, operands: operands.to_vec() }
    }

    pub(super) fn operand(&self, index: usize) -> u32 {
        self.operands.get(index).copied().unwrap_or(0)
    }

    /// Returns the id of the result's type.
    pub(super) fn result_type(&self) -> Option<u32> {
        (Form::from_opcode(self.op)?.results == 2).then(|| self.operand(0))
    }

    /// Returns the id of the result.
    pub(super) fn result(&self) -> Option<u32> {
        match Form::from_opcode(self.op)?.results {
            0 => None,
            results => Some(self.operand(results - 1)),
        }
    }

    /// Replaces the id of the result.
    pub(super) fn set_result(&mut self, id: u32) {
        let results = Form::from_opcode(self.op).map_or(0, |form| form.results);
        if let Some(at) = results.checked_sub(1).and_then(|at| self.operands.get_mut(at)) {
            *at = id;
        }
    }

    /// Appends the words to `out`.
    pub(super) fn write(&self, out: &mut Vec<u32>) {
        out.push((self.operands.len() as u32 + 1) << 16 | self.op as u32);
        out.extend(&self.operands);
    }
}

impl Inst {
    /// Returns the text in the operands from `first` on.
    pub(super) fn text(&self, first: usize) -> String {
        let words = self.operands.get(first..).unwrap_or_default();
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let text = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
        String::from_utf8_lossy(text).into_owned()
    }

    /// True for types, constants, decorations and declarations. Variables and undefined values stand in functions too.
    pub(super) fn is_global(&self) -> bool {
        Form::of_global(self.op).is_some()
    }

    /// True for an instruction that ends a block.
    pub(super) fn is_terminator(&self) -> bool {
        matches!(
            self.op,
            Op::Branch
                | Op::BranchConditional
                | Op::Switch
                | Op::Return
                | Op::ReturnValue
                | Op::Unreachable
                | Op::Kill
                | Op::IgnoreIntersectionKHR
                | Op::TerminateRayKHR
        )
    }
}

/// The operands of an opcode behind its results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Rest {
    /// Ids only.
    Ids,
    /// Ids as far as the count says, and literals.
    IdsThenLiterals(usize),
    /// Literals as far as the count says, and ids.
    LiteralsThenIds(usize),
    /// Ids as far as the first count says, literals as far as the second says, and ids.
    IdsLiteralsIds(usize, usize),
    /// A switch: selector, default, and pairs of a literal and an id.
    Switch,
    /// Ids as far as the count says, and memory operands.
    Memory(usize),
    /// An operation on constants.
    SpecConstantOp,
}

/// The shape of an opcode: number of results (2: type and result; 1: result), and the rest.
#[derive(Debug, Clone, Copy)]
struct Form {
    results: usize,
    rest: Rest,
}

/// All operands that an instruction has.
const ALL: usize = usize::MAX;

impl Form {
    /// Returns the form of an opcode; `None` for one that lowered shaders may not have.
    fn from_opcode(op: Op) -> Option<Self> {
        let (results, rest) = Self::of_global(op).or_else(|| Self::of_code(op))?;
        Some(Self { results, rest })
    }

    /// Types, constants, decorations and declarations.
    fn of_global(op: Op) -> Option<(usize, Rest)> {
        use Rest::{Ids, IdsLiteralsIds, IdsThenLiterals, LiteralsThenIds};
        Some(match op {
            Op::TypeVoid | Op::TypeBool | Op::TypeSampler | Op::TypeAccelerationStructureKHR => (1, Ids),
            Op::TypeRayQueryKHR | Op::TypeArray | Op::TypeRuntimeArray | Op::TypeStruct => (1, Ids),
            Op::TypeFunction | Op::TypeSampledImage => (1, Ids),
            Op::TypeInt | Op::TypeFloat => (1, IdsThenLiterals(0)),
            Op::TypeVector | Op::TypeMatrix | Op::TypeImage => (1, IdsThenLiterals(1)),
            Op::TypePointer => (1, LiteralsThenIds(1)),
            Op::TypeForwardPointer => (0, IdsThenLiterals(1)),
            Op::ConstantTrue | Op::ConstantFalse | Op::ConstantNull | Op::ConstantComposite => (2, Ids),
            Op::SpecConstantTrue | Op::SpecConstantFalse | Op::SpecConstantComposite => (2, Ids),
            Op::Constant | Op::SpecConstant => (2, IdsThenLiterals(0)),
            Op::SpecConstantOp => (2, Rest::SpecConstantOp),
            Op::Variable => (2, LiteralsThenIds(1)),
            Op::Undef => (2, Ids),
            Op::ExtInstImport | Op::String => (1, IdsThenLiterals(0)),
            Op::Decorate | Op::MemberDecorate | Op::DecorateString | Op::MemberDecorateString => {
                (0, IdsThenLiterals(1))
            }
            Op::Name | Op::ExecutionMode => (0, IdsThenLiterals(1)),
            Op::DecorateId | Op::ExecutionModeId => (0, IdsLiteralsIds(1, 1)),
            Op::Capability | Op::Extension | Op::MemoryModel => (0, IdsThenLiterals(0)),
            _ => return None,
        })
    }

    /// Code of functions.
    fn of_code(op: Op) -> Option<(usize, Rest)> {
        use Rest::{Ids, IdsLiteralsIds, IdsThenLiterals, LiteralsThenIds, Memory};
        Some(match op {
            Op::Function => (2, LiteralsThenIds(1)),
            Op::FunctionParameter | Op::FunctionCall | Op::Phi => (2, Ids),
            Op::FunctionEnd | Op::Nop | Op::Return | Op::Unreachable | Op::Kill => (0, Ids),
            Op::IgnoreIntersectionKHR | Op::TerminateRayKHR => (0, Ids),
            Op::Label => (1, Ids),
            Op::Branch | Op::ReturnValue | Op::ControlBarrier | Op::MemoryBarrier | Op::AtomicStore => {
                (0, Ids)
            }
            Op::LoopMerge => (0, IdsThenLiterals(2)),
            Op::SelectionMerge => (0, IdsThenLiterals(1)),
            Op::BranchConditional => (0, IdsThenLiterals(3)),
            Op::Switch => (0, Rest::Switch),
            Op::ExtInst => (2, IdsLiteralsIds(1, 1)),
            Op::Load => (2, Memory(1)),
            Op::Store | Op::CopyMemory => (0, Memory(2)),
            Op::ArrayLength | Op::CompositeExtract => (2, IdsThenLiterals(1)),
            Op::CompositeInsert | Op::VectorShuffle => (2, IdsThenLiterals(2)),
            Op::ImageWrite => (0, IdsLiteralsIds(3, 1)),
            Op::TraceRayKHR | Op::ExecuteCallableKHR | Op::RayQueryInitializeKHR => (0, Ids),
            Op::RayQueryTerminateKHR | Op::RayQueryConfirmIntersectionKHR => (0, Ids),
            Op::RayQueryGenerateIntersectionKHR => (0, Ids),
            _ => return Self::of_value(op),
        })
    }

    /// Code with a result, by ranges of opcodes.
    fn of_value(op: Op) -> Option<(usize, Rest)> {
        use Rest::{Ids, IdsLiteralsIds, IdsThenLiterals};
        // Dref and gather instructions take a third id in front of the image operands.
        let image = |first: u32| match op as u32 - first {
            2 | 3 | 6 | 7 | 9 | 10 => IdsLiteralsIds(3, 1),
            _ => IdsLiteralsIds(2, 1),
        };
        let rest = match op as u32 {
            // Pointers, composites, copies.
            60 | 65..=67 | 70 | 77 | 78 | 80 | 83 | 84 | 86 | 400..=403 => Ids,
            // Images: sampled, read, queried; and sparse ones.
            87..=98 => image(87),
            305..=315 => image(305),
            320 => IdsLiteralsIds(2, 1),
            100..=107 | 316 => Ids,
            // Conversions, arithmetic, logic, bits, derivatives, atomics.
            109..=124 | 126..=152 | 154..=191 | 194..=205 | 227 | 229..=242 => Ids,
            5614 | 5615 | 6035 => Ids,
            // Subgroups: operations with a literal behind the scope, and others.
            342 | 349..=364 => IdsLiteralsIds(1, 1),
            333..=341 | 343..=348 | 365 | 366 | 4421..=4432 => Ids,
            // Dot products of integers, with an optional format.
            4450..=4452 => IdsThenLiterals(2),
            4453..=4455 => IdsThenLiterals(3),
            // Rays, clocks.
            4447 | 4477 | 4479 | 5056 | 5334 | 5340 | 6016..=6026 | 6027..=6032 => Ids,
            _ => return None,
        };
        Some((2, rest))
    }
}

/// Returns the least number of operands that an instruction has, results included.
pub(super) fn least_operands(op: Op) -> usize {
    match op {
        Op::TypeVoid | Op::TypeBool | Op::TypeStruct | Op::Label | Op::Branch | Op::ReturnValue => 1,
        Op::ExtInstImport | Op::Capability | Op::Extension => 1,
        Op::TypeInt | Op::TypeFunction | Op::TypeRuntimeArray | Op::Phi | Op::Store => 2,
        Op::TypeForwardPointer | Op::SelectionMerge | Op::Switch | Op::ExecuteCallableKHR => 2,
        Op::Decorate | Op::MemoryModel | Op::FunctionParameter => 2,
        Op::TypeVector | Op::TypeMatrix | Op::TypeArray | Op::TypePointer | Op::Variable | Op::Load => 3,
        Op::AccessChain | Op::InBoundsAccessChain | Op::FunctionCall | Op::LoopMerge => 3,
        Op::BranchConditional | Op::Constant | Op::SpecConstant | Op::MemberDecorate | Op::EntryPoint => 3,
        Op::Function | Op::ReportIntersectionKHR | Op::ExtInst => 4,
        Op::TraceRayKHR => 11,
        _ => Form::from_opcode(op).map_or(0, |form| form.results),
    }
}

/// An instruction that no lowered shader may have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnknownOpcode(pub(super) Op);

/// Calls `change` with every id of an instruction, the results included. `wide` holds the ids of 64-bit values, on which
/// the length of a switch's literals depends.
pub(super) fn for_each_id(
    inst: &mut Inst,
    wide: &HashSet<u32>,
    mut change: impl FnMut(&mut u32),
) -> Result<(), UnknownOpcode> {
    let op = inst.op;
    let form = Form::from_opcode(op).ok_or(UnknownOpcode(op))?;
    let selector = inst.operand(form.results);
    let split = form.results.min(inst.operands.len());
    let (results, rest) = inst.operands.split_at_mut(split);
    results.iter_mut().for_each(&mut change);
    let (ids, literals, more) = match form.rest {
        Rest::Ids => (ALL, 0, 0),
        Rest::IdsThenLiterals(ids) => (ids, ALL, 0),
        Rest::LiteralsThenIds(literals) => (0, literals, ALL),
        Rest::IdsLiteralsIds(ids, literals) => (ids, literals, ALL),
        Rest::Switch => {
            let literal = if wide.contains(&selector) { 2 } else { 1 };
            let (head, pairs) = rest.split_at_mut(rest.len().min(2));
            head.iter_mut().for_each(&mut change);
            pairs.chunks_exact_mut(literal + 1).filter_map(<[u32]>::last_mut).for_each(&mut change);
            return Ok(());
        }
        Rest::Memory(ids) => {
            rest.iter_mut().take(ids).for_each(&mut change);
            return memory_ids(rest.get_mut(ids..).unwrap_or(&mut []), &mut change).ok_or(UnknownOpcode(op));
        }
        Rest::SpecConstantOp => {
            let extra = rest.first().copied().and_then(Op::from_u32);
            let ids = match extra {
                Some(Op::CompositeExtract) => 1,
                Some(Op::CompositeInsert | Op::VectorShuffle) => 2,
                _ => ALL,
            };
            rest.iter_mut().skip(1).take(ids).for_each(&mut change);
            return Ok(());
        }
    };
    rest.iter_mut().take(ids).for_each(&mut change);
    let behind = ids.saturating_add(literals);
    rest.iter_mut().skip(behind).take(more).for_each(&mut change);
    Ok(())
}

/// Calls `change` with the ids among memory operands; `None` for an operand that is not known.
fn memory_ids(words: &mut [u32], change: &mut impl FnMut(&mut u32)) -> Option<()> {
    const ALIGNED: u32 = 2;
    const WITH_SCOPE: [u32; 2] = [8, 16];
    const WITHOUT_WORDS: u32 = 1 | 4 | 32;
    let mut rest = words.iter_mut();
    while let Some(mask) = rest.next() {
        let mask = *mask;
        if mask & !(WITHOUT_WORDS | ALIGNED | WITH_SCOPE[0] | WITH_SCOPE[1]) != 0 {
            return None;
        }
        if mask & ALIGNED != 0 {
            rest.next()?;
        }
        for scope in WITH_SCOPE {
            if mask & scope != 0 {
                change(rest.next()?);
            }
        }
    }
    Some(())
}

/// Returns the place, among the operands, of the pointer that an instruction loads, stores to or leads on from.
pub(super) fn pointer_place(op: Op) -> Option<usize> {
    match op {
        Op::AccessChain | Op::InBoundsAccessChain | Op::Load => Some(2),
        Op::Store => Some(0),
        _ => None,
    }
}

/// Returns the ids that an instruction uses otherwise than as its pointer, without its results.
pub(super) fn used_beside_pointer(inst: &Inst, wide: &HashSet<u32>) -> Vec<u32> {
    let mut used = used_ids(inst, wide);
    let pointer = pointer_place(inst.op).map(|place| inst.operand(place));
    if let Some(place) = used.iter().position(|id| Some(*id) == pointer) {
        used.remove(place);
    }
    used
}

/// Returns the ids that an instruction uses, without its results.
pub(super) fn used_ids(inst: &Inst, wide: &HashSet<u32>) -> Vec<u32> {
    let mut all = Vec::new();
    let mut copy = inst.clone();
    let results = Form::from_opcode(inst.op).map_or(0, |form| form.results);
    // An unknown opcode was refused when the module was read.
    let _ = for_each_id(&mut copy, wide, |id| all.push(*id));
    if results > 0 && all.len() >= results {
        all.remove(results - 1);
    }
    all
}
