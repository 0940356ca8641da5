//! Records of shaders and hit groups in a shader binding table.

use std::sync::Arc;

use bytemuck::NoUninit;

use super::block_layout::BlockComparison;
use super::shader_module::ShaderModule;
use crate::error::{Error, Result};
use crate::shader::shader_layout::{ShaderLayout, StructLayout};
use crate::shader::spirv::blocks::BlockKind;

/// Bytes that the shaders of a group read through `shaderRecordEXT`. The default has none.
///
/// Shaders read them as a block `layout(shaderRecordEXT, scalar) buffer`. The creation of the pipeline compares the record
/// with the block of each shader of the group: by the members of the Rust struct ([`new`](Self::new)), or by the number of
/// bytes ([`record_bytes`], [`from_bytes`](Self::from_bytes)). Shaders without such a block take any record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ShaderRecord<'a> {
    bytes: &'a [u8],
    layout: Option<StructLayout>,
}

impl<'a> ShaderRecord<'a> {
    /// Returns the bytes of a struct, whose members are compared with those of the block.
    pub fn new<T: ShaderLayout + NoUninit>(record: &'a T) -> Self {
        Self { bytes: bytemuck::bytes_of(record), layout: Some(T::LAYOUT) }
    }

    /// Returns a record of plain bytes. Their number is compared with that of the block.
    pub const fn from_bytes(bytes: &'a [u8]) -> Self {
        Self { bytes, layout: None }
    }

    pub(super) fn with_layout(bytes: &'a [u8], layout: Option<StructLayout>) -> Self {
        Self { bytes, layout }
    }

    /// Returns the layout of the struct that the record was made of.
    pub(super) fn layout(&self) -> Option<StructLayout> {
        self.layout
    }

    /// Returns the bytes of the record.
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Fails unless the record fits the blocks of all shaders of its group.
    pub(super) fn check(&self, pipeline: &str, group: &str, modules: &[Arc<ShaderModule>]) -> Result<()> {
        let mut comparison = self.layout.as_ref().map(|layout| BlockComparison::new(pipeline, layout));
        for module in modules {
            let blocks = &module.reflection.blocks;
            let records = blocks.list.iter().filter(|block| block.kind == BlockKind::ShaderRecord);
            if let Some(comparison) = &mut comparison {
                records.into_iter().try_for_each(|block| comparison.compare(module, block))?;
            }
            let (expected, size) = (blocks.record_bytes().unwrap_or(0), self.bytes.len() as u64);
            if size < expected {
                let (pipeline, group, shader) = (pipeline.to_owned(), group.to_owned(), module.name.clone());
                return Err(Error::ShaderRecord { pipeline, group, shader, expected, size });
            }
        }
        comparison.map_or(Ok(()), |comparison| comparison.finish().map(drop))
    }
}

/// Returns the record of any `bytemuck` type. Its size is compared with that of the block, not its members.
///
/// The type must have the layout of the block: `#[repr(C)]` and `scalar` agree if every member is aligned to its largest
/// scalar.
pub fn record_bytes<T: NoUninit>(record: &T) -> ShaderRecord<'_> {
    ShaderRecord::from_bytes(bytemuck::bytes_of(record))
}
