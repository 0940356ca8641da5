//! A module in sections, with functions in blocks.

use std::collections::{HashMap, HashSet};

use ::spirv::Op;

use super::instruction::{Inst, UnknownOpcode, for_each_id, least_operands};
use crate::shader::spirv::words::{HEADER_WORDS, Instruction, instructions};

/// A block of a function: its label, and its code, which ends with a terminator.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub(super) label: u32,
    pub(super) code: Vec<Inst>,
}

impl Block {
    pub(super) fn terminator(&self) -> Option<&Inst> {
        self.code.last()
    }

    /// Takes out the code behind the variables of the function, which stand at the start of its first block.
    pub(super) fn take_code_behind_variables(&mut self) -> Vec<Inst> {
        let first = self.code.iter().position(|inst| inst.op != Op::Variable);
        self.code.split_off(first.unwrap_or(self.code.len()))
    }

    /// Returns the merge instruction in front of the terminator.
    pub(super) fn merge(&self) -> Option<&Inst> {
        let at = self.code.len().checked_sub(2)?;
        let inst = self.code.get(at)?;
        matches!(inst.op, Op::LoopMerge | Op::SelectionMerge).then_some(inst)
    }
}

/// A function.
#[derive(Debug, Clone)]
pub(super) struct Function {
    /// `OpFunction`.
    pub(super) head: Inst,
    pub(super) parameters: Vec<Inst>,
    pub(super) blocks: Vec<Block>,
}

impl Function {
    pub(super) fn id(&self) -> u32 {
        self.head.operand(1)
    }

    pub(super) fn code(&self) -> impl Iterator<Item = &Inst> {
        self.blocks.iter().flat_map(|block| &block.code)
    }

    pub(super) fn code_mut(&mut self) -> impl Iterator<Item = &mut Inst> {
        self.blocks.iter_mut().flat_map(|block| &mut block.code)
    }

    /// Returns the instruction of each value and parameter.
    pub(super) fn definitions(&self) -> HashMap<u32, Inst> {
        let all = self.code().chain(&self.parameters);
        all.filter_map(|inst| inst.result().map(|id| (id, inst.clone()))).collect()
    }

    /// Makes phis name the block `new`, which now ends as the block `old` did.
    pub(super) fn rename_predecessor(&mut self, old: u32, new: u32) {
        for inst in self.code_mut().filter(|inst| inst.op == Op::Phi) {
            let labels = inst.operands.iter_mut().skip(3).step_by(2);
            labels.filter(|label| **label == old).for_each(|label| *label = new);
        }
    }
}

/// Returns the functions with an instruction that `is_it`, and those that call such ones, directly or not.
pub(super) fn functions_that_reach<'a>(
    functions: impl Iterator<Item = &'a Function> + Clone,
    is_it: impl Fn(&Inst) -> bool,
) -> HashSet<u32> {
    let mut found: HashSet<u32> = HashSet::new();
    loop {
        let reaches =
            |inst: &Inst| is_it(inst) || (inst.op == Op::FunctionCall && found.contains(&inst.operand(2)));
        let all = functions.clone().filter(|function| function.code().any(reaches));
        let more: HashSet<u32> = all.map(Function::id).collect();
        if more == found {
            return found;
        }
        found = more;
    }
}

/// A module in sections. Debug information is left out, but for names and texts.
#[derive(Debug, Clone, Default)]
pub(super) struct Module {
    pub(super) version: u32,
    /// Ids are below.
    pub(super) bound: u32,
    pub(super) capabilities: Vec<u32>,
    /// Words of `OpExtension`.
    pub(super) extensions: Vec<Inst>,
    pub(super) imports: Vec<Inst>,
    pub(super) memory_model: Vec<u32>,
    pub(super) entry_points: Vec<Inst>,
    /// `OpExecutionMode` and `OpExecutionModeId`.
    pub(super) modes: Vec<Inst>,
    /// Texts (`OpString`), which `debugPrintfEXT` prints.
    pub(super) strings: Vec<Inst>,
    pub(super) names: HashMap<u32, String>,
    pub(super) decorations: Vec<Inst>,
    /// Types, constants and variables.
    pub(super) globals: Vec<Inst>,
    pub(super) functions: Vec<Function>,
    /// Ids of 64-bit integers, for the literals of switches.
    pub(super) wide: HashSet<u32>,
}

/// The start of the names of instruction sets without meaning, which are left out.
const NON_SEMANTIC: &str = "NonSemantic.";
/// The set without meaning that is kept.
const DEBUG_PRINTF: &str = "NonSemantic.DebugPrintf";

impl Module {
    /// Reads a module whose structure has been validated. The error is a message with the instruction's name.
    pub(super) fn parse(words: &[u32]) -> Result<Self, String> {
        let header = words.get(..HEADER_WORDS).ok_or("the header is cut off")?;
        let mut module = Self { version: header[1], bound: header[3], ..Self::default() };
        let mut reader = Reader::default();
        for instruction in instructions(words) {
            let instruction = instruction?;
            let Some(op) = instruction.op else {
                return Err(format!("the opcode {} is not known", instruction.words[0] & 0xFFFF));
            };
            module.read(op, &instruction, &mut reader)?;
        }
        if reader.function.is_some() {
            return Err("a function has no end".to_owned());
        }
        module.check_functions()?;
        Ok(module)
    }

    /// Fails for functions without blocks, blocks without a terminator, and functions that call each other in a circle.
    fn check_functions(&self) -> Result<(), String> {
        let is_whole = |block: &Block| block.terminator().is_some_and(Inst::is_terminator);
        if self.functions.iter().any(|function| function.blocks.is_empty()) {
            return Err("OpFunction has no blocks".to_owned());
        }
        if !self.functions.iter().flat_map(|function| &function.blocks).all(is_whole) {
            return Err("OpLabel starts a block without a terminator".to_owned());
        }
        // Functions are done once all that they call are done.
        let mut done: HashSet<u32> = HashSet::new();
        let known: HashSet<u32> = self.functions.iter().map(Function::id).collect();
        loop {
            let ready = |function: &&Function| {
                let calls = function.code().filter(|inst| inst.op == Op::FunctionCall);
                let mut callees = calls.map(|inst| inst.operand(2)).filter(|id| known.contains(id));
                callees.all(|id| done.contains(&id))
            };
            let now: HashSet<u32> = self.functions.iter().filter(ready).map(Function::id).collect();
            if now.len() == done.len() {
                break;
            }
            done = now;
        }
        let is_done = done.len() == known.len();
        if is_done { Ok(()) } else { Err("OpFunctionCall calls its own function in a circle".to_owned()) }
    }

    fn read(&mut self, op: Op, instruction: &Instruction<'_>, reader: &mut Reader) -> Result<(), String> {
        let inst = Inst::new(op, instruction.operands());
        if inst.operands.len() < least_operands(op) {
            return Err(format!("Op{op:?} is cut off"));
        }
        match op {
            Op::Source | Op::SourceContinued | Op::SourceExtension | Op::ModuleProcessed => {}
            Op::MemberName | Op::Line | Op::NoLine | Op::Nop => {}
            Op::String => self.strings.push(inst),
            Op::Name => _ = self.names.insert(inst.operand(0), instruction.string(1).0),
            Op::Capability => self.capabilities.push(inst.operand(0)),
            Op::Extension => self.extensions.push(inst),
            Op::ExtInstImport => {
                let name = instruction.string(1).0;
                if name.starts_with(NON_SEMANTIC) && !name.starts_with(DEBUG_PRINTF) {
                    reader.dropped_sets.insert(inst.operand(0));
                } else {
                    self.imports.push(inst);
                }
            }
            Op::MemoryModel => self.memory_model = inst.operands,
            Op::EntryPoint => self.entry_points.push(inst),
            Op::ExecutionMode | Op::ExecutionModeId => self.modes.push(inst),
            Op::Decorate | Op::DecorateId | Op::MemberDecorate | Op::DecorateString => {
                self.decorations.push(inst);
            }
            Op::MemberDecorateString => {}
            Op::ExtInst if reader.dropped_sets.contains(&inst.operand(2)) => {}
            _ => return self.read_code(inst, reader),
        }
        Ok(())
    }

    fn read_code(&mut self, inst: Inst, reader: &mut Reader) -> Result<(), String> {
        for_each_id(&mut inst.clone(), &self.wide, |_| {})
            .map_err(|UnknownOpcode(op)| format!("Op{op:?} cannot be lowered"))?;
        if let (Some(ty), Some(id)) = (inst.result_type(), inst.result())
            && reader.wide_types.contains(&ty)
        {
            self.wide.insert(id);
        }
        if inst.op == Op::TypeInt && inst.operand(1) == 64 {
            reader.wide_types.insert(inst.operand(0));
        }
        let out_of_place = || format!("Op{:?} stands outside of a block", inst.op);
        match inst.op {
            Op::Function if reader.function.is_none() => {
                reader.function = Some(Function { head: inst, parameters: Vec::new(), blocks: Vec::new() });
            }
            Op::FunctionEnd => self.functions.push(reader.function.take().ok_or_else(out_of_place)?),
            Op::Function => return Err(out_of_place()),
            _ => match &mut reader.function {
                None if !inst.is_global() => return Err(out_of_place()),
                None => self.globals.push(inst),
                Some(_) if inst.is_global() && !matches!(inst.op, Op::Variable | Op::Undef) => {
                    return Err(format!("Op{:?} stands in a function", inst.op));
                }
                Some(function) if inst.op == Op::FunctionParameter => function.parameters.push(inst),
                Some(function) if inst.op == Op::Label => {
                    function.blocks.push(Block { label: inst.operand(0), code: Vec::new() });
                }
                Some(function) => function.blocks.last_mut().ok_or_else(out_of_place)?.code.push(inst),
            },
        }
        Ok(())
    }

    pub(super) fn new_id(&mut self) -> u32 {
        let id = self.bound;
        self.bound = id.saturating_add(1);
        id
    }

    /// Returns the id with this debug name.
    pub(super) fn named(&self, name: &str) -> Option<u32> {
        self.names.iter().find(|(_, own)| *own == name).map(|(id, _)| *id)
    }

    /// Returns the function whose debug name starts with `name` and a parenthesis, as glslang writes it.
    pub(super) fn function_named(&self, name: &str) -> Option<u32> {
        let is_it = |own: &str| own.strip_prefix(name).is_some_and(|rest| rest.starts_with('('));
        self.names.iter().find(|(_, own)| is_it(own)).map(|(id, _)| *id)
    }

    /// Returns the words of the module.
    pub(super) fn words(&self) -> Vec<u32> {
        let mut out = vec![::spirv::MAGIC_NUMBER, self.version, 0, self.bound, 0];
        for capability in &self.capabilities {
            Inst::new(Op::Capability, &[*capability]).write(&mut out);
        }
        self.extensions.iter().chain(&self.imports).for_each(|inst| inst.write(&mut out));
        Inst::new(Op::MemoryModel, &self.memory_model).write(&mut out);
        let first = self.entry_points.iter().chain(&self.modes).chain(&self.strings);
        first.chain(&self.decorations).chain(&self.globals).for_each(|inst| inst.write(&mut out));
        for function in &self.functions {
            function.head.write(&mut out);
            function.parameters.iter().for_each(|inst| inst.write(&mut out));
            for block in &function.blocks {
                Inst::new(Op::Label, &[block.label]).write(&mut out);
                block.code.iter().for_each(|inst| inst.write(&mut out));
            }
            Inst::new(Op::FunctionEnd, &[]).write(&mut out);
        }
        out
    }
}

/// State of the reader.
#[derive(Default)]
struct Reader {
    function: Option<Function>,
    dropped_sets: HashSet<u32>,
    wide_types: HashSet<u32>,
}
