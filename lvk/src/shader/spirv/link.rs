//! Links a function of one module into another.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::words::{HEADER_WORDS, Instruction, instructions};

/// The header word that holds the id bound.
const BOUND: usize = 3;

/// The sections of a module that another function is linked into.
pub(crate) struct ModuleSections {
    /// The header.
    pub(crate) header: Vec<u32>,
    pub(crate) capabilities: Vec<u32>,
    /// Everything up to and including the decorations.
    pub(crate) annotations: Vec<u32>,
    /// Types, constants and variables.
    pub(crate) globals: Vec<u32>,
    pub(crate) functions: Vec<u32>,
}

impl ModuleSections {
    /// Splits `words` into sections. Fails if an instruction is truncated.
    pub(crate) fn parse(words: &[u32]) -> Result<Self, String> {
        let header = words.get(..HEADER_WORDS).ok_or("the header is cut off")?.to_vec();
        let mut all = Self {
            header,
            capabilities: Vec::new(),
            annotations: Vec::new(),
            globals: Vec::new(),
            functions: Vec::new(),
        };
        for instruction in instructions(words) {
            let instruction = instruction?;
            let section = match instruction.op {
                _ if !all.functions.is_empty() => &mut all.functions,
                Some(Op::Function) => &mut all.functions,
                Some(Op::Capability) => &mut all.capabilities,
                op if all.globals.is_empty() && op.is_none_or(is_annotation) => &mut all.annotations,
                _ => &mut all.globals,
            };
            section.extend(instruction.words);
        }
        Ok(all)
    }

    pub(crate) fn words(self) -> Vec<u32> {
        [self.header, self.capabilities, self.annotations, self.globals, self.functions].concat()
    }

    pub(crate) fn new_id(&mut self) -> u32 {
        let id = self.header[BOUND];
        self.header[BOUND] = id.wrapping_add(1);
        id
    }

    /// Adds a constant of one word and returns its id.
    pub(crate) fn add_constant(&mut self, ty: u32, value: u32) -> u32 {
        let id = self.new_id();
        push_instruction(&mut self.globals, Op::Constant, &[ty, id, value]);
        id
    }

    /// Adds the function `name` of `donor` with its types, constants and decorations. Returns the ids for calls.
    ///
    /// Types that SPIR-V allows only once are shared with those of this module.
    pub(crate) fn link_function(&mut self, donor: &[u32], name: &str) -> Result<LinkedFunction, String> {
        let code: Vec<_> = instructions(donor).collect::<Result<_, _>>()?;
        let wanted = |i: &&Instruction<'_>| i.op == Some(Op::Name) && i.string(1).0.starts_with(name);
        let function = code.iter().find(wanted).ok_or("the function is missing")?.operand(0);
        let mut ids = IdRemap { known: self.unique_types()?, mapped: HashMap::new() };
        let body = function_body(&code, function);
        for instruction in required_globals(&code, body) {
            self.link_global(instruction, &mut ids);
        }
        let mut functions = std::mem::take(&mut self.functions);
        for instruction in body {
            let words = self.remap_operands(instruction, &mut ids);
            functions.extend(words);
        }
        self.functions = functions;
        for instruction in code.iter().filter(|i| matches!(i.op, Some(Op::Decorate | Op::MemberDecorate))) {
            if let Some(target) =
                ids.mapped.get(&instruction.operand(0)).filter(|id| !ids.known.contains(**id))
            {
                let at = self.annotations.len();
                self.annotations.extend(instruction.words);
                self.annotations[at + 1] = *target;
            }
        }
        let id = |of: u32| ids.mapped.get(&of).copied().ok_or("an id is missing");
        let parameter_type = |index: usize| {
            let parameters = body.iter().filter(|i| i.op == Some(Op::FunctionParameter));
            parameters.map(|i| i.operand(0)).nth(index).map_or(Err("a parameter is missing"), id)
        };
        let result = body.first().map_or(Err("the function is empty"), |first| id(first.operand(0)))?;
        Ok(LinkedFunction {
            function: id(function)?,
            result,
            address: parameter_type(0)?,
            word: parameter_type(1)?,
        })
    }

    fn link_global(&mut self, instruction: &Instruction<'_>, ids: &mut IdRemap) {
        let result = result_operand(instruction);
        let mut shape: Vec<u32> = instruction.words.to_vec();
        for (index, word) in shape.iter_mut().enumerate().skip(1) {
            if index != result + 1 && is_id(instruction, index - 1) {
                *word = ids.mapped.get(word).copied().unwrap_or(0);
            }
        }
        shape[result + 1] = 0;
        if let Some(known) = ids.known.0.get(&shape) {
            ids.mapped.insert(instruction.operand(result), *known);
            return;
        }
        let id = self.new_id();
        ids.mapped.insert(instruction.operand(result), id);
        shape[result + 1] = id;
        self.globals.extend(shape);
    }

    fn remap_operands(&mut self, instruction: &Instruction<'_>, ids: &mut IdRemap) -> Vec<u32> {
        let mut words = instruction.words.to_vec();
        for (index, word) in words.iter_mut().enumerate().skip(1) {
            if is_id(instruction, index - 1) {
                *word = *ids.mapped.entry(*word).or_insert_with(|| self.new_id());
            }
        }
        words
    }

    /// Returns the types that SPIR-V allows only once, by their words without the result.
    fn unique_types(&self) -> Result<DefinedIds, String> {
        let mut known = HashMap::new();
        for instruction in instructions(&[self.header.clone(), self.globals.clone()].concat()) {
            let instruction = instruction?;
            if instruction.op.is_some_and(is_unique) && instruction.words.len() > 1 {
                let mut shape = instruction.words.to_vec();
                shape[1] = 0;
                known.insert(shape, instruction.operand(0));
            }
        }
        Ok(DefinedIds(known))
    }
}

/// Ids of a linked function.
pub(crate) struct LinkedFunction {
    pub(crate) function: u32,
    /// Return type.
    pub(crate) result: u32,
    /// Type of the first parameter.
    pub(crate) address: u32,
    /// Type of the second parameter.
    pub(crate) word: u32,
}

struct IdRemap {
    known: DefinedIds,
    /// Ids in this module by the ids of the donor.
    mapped: HashMap<u32, u32>,
}

struct DefinedIds(HashMap<Vec<u32>, u32>);

impl DefinedIds {
    fn contains(&self, id: u32) -> bool {
        self.0.values().any(|known| *known == id)
    }
}

/// Appends an instruction.
pub(crate) fn push_instruction(section: &mut Vec<u32>, op: Op, operands: &[u32]) {
    section.push((operands.len() as u32 + 1) << 16 | op as u32);
    section.extend(operands);
}

/// Returns the types and constants that `body` needs, in their order.
fn required_globals<'a, 'b>(
    code: &'a [Instruction<'b>],
    body: &[Instruction<'b>],
) -> Vec<&'a Instruction<'b>> {
    let ids_of = |i: &Instruction<'b>| {
        let is_id = |(index, word): (usize, &u32)| is_id(i, index).then_some(*word);
        i.operands().iter().enumerate().filter_map(is_id).collect::<Vec<_>>()
    };
    let mut wanted: HashSet<u32> = body.iter().flat_map(ids_of).collect();
    let mut found = Vec::new();
    for global in code.iter().rev().filter(|i| i.op.is_some_and(is_type_or_constant)) {
        if wanted.contains(&global.operand(result_operand(global))) {
            wanted.extend(ids_of(global));
            found.push(global);
        }
    }
    found.reverse();
    found
}

/// Returns the index of the operand that is the id of a type or constant.
fn result_operand(instruction: &Instruction<'_>) -> usize {
    if instruction.op.is_some_and(is_type) { 0 } else { 1 }
}

fn function_body<'a, 'b>(code: &'a [Instruction<'b>], function: u32) -> &'a [Instruction<'b>] {
    let start = code.iter().position(|i| i.op == Some(Op::Function) && i.operand(1) == function);
    let rest = &code[start.unwrap_or(code.len())..];
    let end = rest.iter().position(|i| i.op == Some(Op::FunctionEnd));
    end.map_or(&[], |end| &rest[..=end])
}

/// True for instructions that precede types, constants and variables.
fn is_annotation(op: Op) -> bool {
    use Op::{
        Decorate, DecorateId, DecorateString, DecorationGroup, EntryPoint, ExecutionMode, ExecutionModeId,
        ExtInstImport, Extension, GroupDecorate, GroupMemberDecorate, MemberDecorate, MemberDecorateString,
        MemberName, MemoryModel, ModuleProcessed, Name, Source, SourceContinued, SourceExtension, String,
    };
    matches!(
        op,
        Decorate
            | DecorateId
            | DecorateString
            | DecorationGroup
            | EntryPoint
            | ExecutionMode
            | ExecutionModeId
            | ExtInstImport
            | Extension
            | GroupDecorate
            | GroupMemberDecorate
            | MemberDecorate
            | MemberDecorateString
            | MemberName
            | MemoryModel
            | ModuleProcessed
            | Name
            | Source
            | SourceContinued
            | SourceExtension
            | String
    )
}

fn is_unique(op: Op) -> bool {
    use Op::{TypeBool, TypeFloat, TypeFunction, TypeInt, TypePointer, TypeVector, TypeVoid};
    matches!(op, TypeBool | TypeFloat | TypeFunction | TypeInt | TypePointer | TypeVector | TypeVoid)
}

fn is_type(op: Op) -> bool {
    is_unique(op) || matches!(op, Op::TypeStruct | Op::TypeRuntimeArray)
}

fn is_type_or_constant(op: Op) -> bool {
    is_type(op) || matches!(op, Op::Constant | Op::ConstantComposite | Op::ConstantTrue | Op::ConstantFalse)
}

/// True if operand `index`, counted from 0, is an id. Covers only the instructions of the donors.
fn is_id(instruction: &Instruction<'_>, index: usize) -> bool {
    use Op::{
        BranchConditional, Constant, Function, LoopMerge, SelectionMerge, Store, TypeFloat, TypeInt,
        TypePointer, TypeVector, Variable,
    };
    match instruction.op {
        Some(TypeInt | TypeFloat) => index == 0,
        Some(TypeVector) => index < 2,
        Some(TypePointer) => index != 1,
        Some(Constant | Store) => index < 2,
        Some(Op::Load) => index < 3,
        Some(Variable | Function) => index != 2,
        Some(SelectionMerge) => index == 0,
        Some(LoopMerge) => index < 2,
        Some(BranchConditional) => index < 3,
        _ => true,
    }
}
