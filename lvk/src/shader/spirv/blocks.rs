//! The blocks of a module whose bytes the application writes: push constants, shader records and buffer references.

use std::collections::{BTreeMap, HashSet};

use ::spirv::{Decoration, StorageClass};

use super::parsed::{KnownSizes, MAX_NESTING, ParsedModule, Type};

/// The blocks of an entry point, and the structs in them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Blocks {
    pub(crate) list: Vec<Block>,
    /// Structs by type id. Each is there once, however often it is nested.
    structs: BTreeMap<u32, BlockStruct>,
}

/// A block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Block {
    pub(crate) kind: BlockKind,
    /// Name of its type; empty in a module without names.
    pub(crate) name: String,
    /// Id of its type.
    pub(crate) ty: u32,
}

/// Kind of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum BlockKind {
    PushConstants,
    ShaderRecord,
    BufferReference,
}

/// The members of a struct, or the reason why they cannot be told.
type BlockStruct = Result<Vec<BlockMember>, String>;

/// A member of a struct in a block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct BlockMember {
    /// Empty in a module without names.
    pub(crate) name: String,
    pub(crate) offset: u64,
    /// Size in bytes, without padding behind the last member of a struct; 0 for an array without a length.
    pub(crate) bytes: u64,
    pub(crate) shape: MemberShape,
}

/// Contents of a member.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum MemberShape {
    /// A scalar or a vector, an address, or an array or matrix of them, with the bytes from element to element.
    Plain { stride: Option<u64> },
    /// Structs, one after the other, with the bytes from element to element. No `count` means an array without a
    /// length.
    Structs { ty: u32, count: Option<u64>, stride: u64 },
    /// An array without a length, of anything else.
    Unsized,
}

impl Blocks {
    /// Returns the blocks that the entry point with this index uses. Buffer references belong to the whole module.
    pub(crate) fn from_module(module: &ParsedModule, entry: usize) -> Self {
        let mut blocks = Self::default();
        let mut collector =
            BlockCollector { module, blocks: &mut blocks, seen: HashSet::new(), known: KnownSizes::new() };
        for variable in module.variables.iter().filter(|variable| module.in_interface(entry, variable)) {
            let kind = match variable.storage {
                class if class == StorageClass::PushConstant as u32 => BlockKind::PushConstants,
                class if class == StorageClass::ShaderRecordBufferKHR as u32 => BlockKind::ShaderRecord,
                _ => continue,
            };
            if let Some(Type::Pointer { target }) = module.types.get(&variable.ty) {
                collector.add(kind, *target);
            }
        }
        for target in &module.buffer_references {
            collector.add(BlockKind::BufferReference, *target);
        }
        blocks
    }

    /// Returns blocks of these structs, by type id.
    #[cfg(test)]
    pub(crate) fn from_structs(structs: impl IntoIterator<Item = (u32, Vec<BlockMember>)>) -> Self {
        let structs = structs.into_iter().map(|(ty, members)| (ty, Ok(members))).collect();
        Self { list: Vec::new(), structs }
    }

    /// Returns the members of a struct.
    pub(crate) fn members(&self, ty: u32) -> Result<&[BlockMember], &str> {
        match self.structs.get(&ty) {
            Some(Ok(members)) => Ok(members),
            Some(Err(why)) => Err(why),
            None => Err("its type is no struct"),
        }
    }

    /// Returns the bytes that the shader reads of its record: the end of the last member. `None` without a record, and
    /// for a record whose size cannot be told.
    pub(crate) fn record_bytes(&self) -> Option<u64> {
        let record = self.list.iter().find(|block| block.kind == BlockKind::ShaderRecord)?;
        let members = self.members(record.ty).ok()?;
        members.iter().map(|member| member.offset.saturating_add(member.bytes)).max()
    }
}

/// Collects blocks, each once: a module may have many variables and pointers of one type, whose names can be long.
struct BlockCollector<'a> {
    module: &'a ParsedModule,
    blocks: &'a mut Blocks,
    seen: HashSet<(BlockKind, u32)>,
    known: KnownSizes,
}

impl BlockCollector<'_> {
    fn add(&mut self, kind: BlockKind, ty: u32) {
        let module = self.module;
        if !matches!(module.types.get(&ty), Some(Type::Struct { .. })) || !self.seen.insert((kind, ty)) {
            return;
        }
        let name = module.names.get(&ty).cloned().unwrap_or_default();
        self.blocks.list.push(Block { kind, name, ty });
        let mut waiting = vec![ty];
        while let Some(ty) = waiting.pop() {
            if self.blocks.structs.contains_key(&ty) {
                continue;
            }
            let members = struct_members(module, ty, &mut self.known);
            let nested = members.iter().flatten().filter_map(|member| match member.shape {
                MemberShape::Structs { ty, .. } => Some(ty),
                MemberShape::Plain { .. } | MemberShape::Unsized => None,
            });
            waiting.extend(nested);
            self.blocks.structs.insert(ty, members);
        }
    }
}

fn struct_members(module: &ParsedModule, ty: u32, known: &mut KnownSizes) -> BlockStruct {
    let Some(Type::Struct { members }) = module.types.get(&ty) else {
        return Err("its type is no struct".to_owned());
    };
    let member = |(index, member): (u32, &u32)| {
        let name = module.member_names.get(&(ty, index)).cloned().unwrap_or_default();
        let offset = module.member_decoration(ty, index, Decoration::Offset);
        let offset = offset.ok_or_else(|| format!("its member '{name}' has no offset"))?;
        let (shape, bytes) = match member_shape(module, ty, index, *member) {
            shape @ (MemberShape::Unsized | MemberShape::Structs { count: None, .. }) => (shape, 0),
            shape => {
                let size = module.member_size(ty, index, *member, known);
                (shape, size.map_err(|why| format!("its member '{name}': {why}"))?)
            }
        };
        Ok(BlockMember { name, offset: offset.into(), bytes, shape })
    };
    (0..).zip(members).map(member).collect()
}

fn member_shape(module: &ParsedModule, block: u32, index: u32, member: u32) -> MemberShape {
    let (mut ty, mut count, mut stride) = (member, Some(1_u64), None);
    for _ in 0..MAX_NESTING {
        let array_stride = module.decoration(ty, Decoration::ArrayStride).map(u64::from);
        let (element, length) = match module.types.get(&ty) {
            Some(Type::Array { element, length }) => (*element, module.array_length(*length).ok()),
            Some(Type::RuntimeArray { element }) => (*element, None),
            Some(Type::Struct { .. }) => {
                return MemberShape::Structs { ty, count, stride: stride.unwrap_or(0) };
            }
            _ if count.is_none() => return MemberShape::Unsized,
            Some(Type::Matrix { .. }) => {
                let matrix = module.member_decoration(block, index, Decoration::MatrixStride);
                return MemberShape::Plain { stride: stride.or(matrix.map(u64::from)) };
            }
            _ => return MemberShape::Plain { stride },
        };
        // The elements of an inner array follow each other without gaps, or it is no list of structs.
        let is_dense =
            stride.is_none_or(|outer| array_stride.zip(length).is_some_and(|(s, n)| s * n == outer));
        if !is_dense {
            return if count.is_none() { MemberShape::Unsized } else { MemberShape::Plain { stride } };
        }
        count = count.zip(length).map(|(outer, inner)| outer.saturating_mul(inner));
        (ty, stride) = (element, array_stride);
        if stride.is_none() {
            break;
        }
    }
    if count.is_none() { MemberShape::Unsized } else { MemberShape::Plain { stride } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::spirv::parsed::Variable;

    #[test]
    fn a_block_of_many_variables_and_pointers_is_listed_once() {
        let mut module = ParsedModule::default();
        module.types.insert(1, Type::Struct { members: Vec::new() });
        module.types.insert(2, Type::Pointer { target: 1 });
        let storage = StorageClass::PushConstant as u32;
        module.variables = (10..20).map(|id| Variable { id, ty: 2, storage }).collect();
        module.buffer_references = vec![1; 10];
        let kinds: Vec<_> = Blocks::from_module(&module, 0).list.iter().map(|block| block.kind).collect();
        assert_eq!(kinds, [BlockKind::PushConstants, BlockKind::BufferReference]);
    }
}
