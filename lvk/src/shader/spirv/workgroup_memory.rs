//! Bytes of the shared memory of a workgroup, and of the payload from a task workgroup to its mesh workgroups.
//!
//! They are counted by Vulkan's rules for `maxComputeSharedMemorySize`: variables one after the other in the layout of
//! std430, booleans as 32 bits.

use std::collections::HashMap;

use ::spirv::{Decoration, Op, StorageClass};

use super::parsed::{MAX_NESTING, ParsedModule, Type, Variable};
use super::words;

/// Declarations of a module with shared memory. Specialization constants of each pipeline may size its arrays.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct SharedMemory {
    /// The module up to its first function; empty without shared memory.
    declarations: Vec<u32>,
    /// Index of the entry point.
    entry: usize,
}

/// Bytes of one workgroup.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct SharedBytes {
    /// Bytes that its invocations share (`shared`).
    pub(crate) shared: u64,
    /// Bytes of the payload from a task to its mesh workgroups (`taskPayloadSharedEXT`).
    pub(crate) payload: u64,
}

/// Size and alignment in bytes.
type SizeAlign = (u64, u64);

impl SharedMemory {
    pub(crate) fn from_module(words: &[u32], module: &ParsedModule, entry: usize) -> Self {
        let shares =
            |variable: &Variable| has_storage_class(variable, SHARED) || has_storage_class(variable, PAYLOAD);
        let any = module.variables.iter().any(|it| shares(it) && module.in_interface(entry, it));
        let declarations = if any { declarations(words).to_vec() } else { Vec::new() };
        Self { declarations, entry }
    }

    /// Returns the bytes with these values of specialization constants, by their ids. Other constants have their
    /// defaults. Variables of unknown size count as 0.
    pub(crate) fn bytes(&self, constants: &HashMap<u32, u32>) -> SharedBytes {
        if self.declarations.is_empty() {
            return SharedBytes::default();
        }
        let Ok(module) = ParsedModule::specialized(&self.declarations, constants) else {
            return SharedBytes::default();
        };
        let of = |storage| TypeSizes { module: &module, known: HashMap::new() }.of_all(self.entry, storage);
        SharedBytes { shared: of(SHARED), payload: of(PAYLOAD) }
    }
}

const SHARED: StorageClass = StorageClass::Workgroup;
const PAYLOAD: StorageClass = StorageClass::TaskPayloadWorkgroupEXT;

fn has_storage_class(variable: &Variable, storage: StorageClass) -> bool {
    variable.storage == storage as u32
}

/// Returns all words before the first function.
fn declarations(words: &[u32]) -> &[u32] {
    let before = words::instructions(words)
        .map_while(Result::ok)
        .take_while(|instruction| instruction.op != Some(Op::Function));
    let length: usize = before.map(|instruction| instruction.words.len()).sum();
    words.get(..words::HEADER_WORDS + length).unwrap_or(words)
}

/// Sizes of the types of a module, each computed once.
struct TypeSizes<'a> {
    module: &'a ParsedModule,
    known: HashMap<u32, Option<SizeAlign>>,
}

impl TypeSizes<'_> {
    /// Returns the bytes of all variables. Blocks overlap, other variables lie one after the other.
    fn of_all(&mut self, entry: usize, storage: StorageClass) -> u64 {
        let (mut end, mut blocks) = (0, 0);
        let module = self.module;
        for variable in module
            .variables
            .iter()
            .filter(|it| has_storage_class(it, storage) && module.in_interface(entry, it))
        {
            let Some(Type::Pointer { target }) = module.types.get(&variable.ty) else { continue };
            let Some(room) = self.size_of(*target, MAX_NESTING) else { continue };
            if module.decoration(*target, Decoration::Block).is_some() {
                blocks = room.0.max(blocks);
            } else {
                end = place_after(end, room);
            }
        }
        end.max(blocks)
    }

    fn size_of(&mut self, ty: u32, nesting: u32) -> Option<SizeAlign> {
        if let Some(known) = self.known.get(&ty) {
            return *known;
        }
        let nesting = nesting.checked_sub(1)?;
        let found = self.compute_size(ty, nesting);
        self.known.insert(ty, found);
        found
    }

    fn compute_size(&mut self, ty: u32, nesting: u32) -> Option<SizeAlign> {
        match self.module.types.get(&ty)? {
            Type::Bool => Some((4, 4)),
            Type::Number { bytes, .. } => Some(((*bytes).into(), (*bytes).max(1).into())),
            Type::Pointer { .. } => Some((8, 8)),
            Type::Vector { element, count } => {
                let (bytes, _) = self.size_of(*element, nesting)?;
                let count = u64::from(*count);
                Some((bytes.saturating_mul(count), bytes.saturating_mul(count.next_power_of_two()).max(1)))
            }
            Type::Matrix { column, count } => {
                let column = self.size_of(*column, nesting)?;
                Some((align_size(column).saturating_mul((*count).into()), column.1))
            }
            Type::Array { element, length } => {
                let element = self.size_of(*element, nesting)?;
                let stride = self.module.decoration(ty, Decoration::ArrayStride).map(u64::from);
                let stride = stride.unwrap_or_else(|| align_size(element));
                Some((stride.saturating_mul(self.module.constant_value(*length)?.into()), element.1))
            }
            Type::Struct { members } => self.struct_size(ty, members, nesting),
            Type::RuntimeArray { .. } | Type::Image { .. } | Type::SubpassInput { .. } | Type::Opaque(_) => {
                None
            }
        }
    }

    fn struct_size(&mut self, ty: u32, members: &[u32], nesting: u32) -> Option<SizeAlign> {
        let (mut end, mut align) = (0, 1);
        for (index, member) in (0..).zip(members) {
            let room = self.size_of(*member, nesting)?;
            end = match self.module.member_decoration(ty, index, Decoration::Offset) {
                Some(offset) => room.0.saturating_add(offset.into()).max(end),
                None => place_after(end, room),
            };
            align = room.1.max(align);
        }
        Some((align_size((end, align)), align))
    }
}

/// Returns the end of an object that is placed after `end` at its alignment.
fn place_after(end: u64, room: SizeAlign) -> u64 {
    align_size((end, room.1)).saturating_add(room.0)
}

/// Returns the size as a multiple of the alignment.
fn align_size((bytes, align): SizeAlign) -> u64 {
    bytes.checked_next_multiple_of(align).unwrap_or(u64::MAX)
}
