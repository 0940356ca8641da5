//! Rust structs for the blocks of a pipeline's shaders, compared with the blocks when the pipeline is created.

use super::shader_module::ShaderModule;
use crate::error::layout_difference::LayoutDifference;
use crate::error::{Error, Result};
use crate::shader::layout_comparison::{compare_layout, is_block_name};
use crate::shader::shader_layout::{ShaderLayout, StructLayout};
use crate::shader::spirv::blocks::{Block, BlockKind};

/// The Rust struct whose bytes a block of the shaders reads.
///
/// A pipeline compares the struct with every such block of its shaders when it is created: names, offsets and sizes of
/// all members. A difference is [`Error::LayoutMismatch`]. Commands cost nothing more. A struct for several stages may
/// have members that the block of a stage lacks, if another stage has them. See
/// [`manual::shaders`](crate::manual::shaders) for the rules.
///
/// ```no_run
/// # use lvk::*;
/// # fn example(ctx: &Context, module: ShaderModuleHandle) -> Result<()> {
/// lvk::shader_struct! {
///     /// `layout(push_constant, scalar) uniform Push { Frame frame; uint image; };`
///     #[derive(Clone, Copy, bytemuck::NoUninit)]
///     #[repr(C)]
///     struct Push { frame: u64, image: u32, _padding: u32 }
///
///     /// `layout(buffer_reference, scalar) readonly buffer Frame { vec3 eye; float time; };`
///     #[derive(Clone, Copy, bytemuck::NoUninit)]
///     #[repr(C)]
///     struct Frame { eye: [f32; 3], time: f32 }
/// }
/// let pipeline = ctx.create_compute_pipeline(&ComputePipelineDesc {
///     module: Some(module),
///     layouts: &[BlockLayout::push_constants::<Push>(), BlockLayout::buffer_reference::<Frame>("Frame")],
///     ..Default::default()
/// })?;
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockLayout {
    target: BlockTarget,
    layout: StructLayout,
}

/// The blocks that a [`BlockLayout`] is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BlockTarget {
    PushConstants,
    BufferReference(&'static str),
}

impl BlockLayout {
    /// Returns the layout of the push constants.
    pub const fn push_constants<T: ShaderLayout>() -> Self {
        Self { target: BlockTarget::PushConstants, layout: T::LAYOUT }
    }

    /// Returns the layout of the `buffer_reference` blocks whose type is called `block`. If the only member of the block
    /// is an array without a length, `T` is an element of it.
    pub const fn buffer_reference<T: ShaderLayout>(block: &'static str) -> Self {
        Self { target: BlockTarget::BufferReference(block), layout: T::LAYOUT }
    }

    fn is_for(&self, block: &Block) -> bool {
        match self.target {
            BlockTarget::PushConstants => block.kind == BlockKind::PushConstants,
            BlockTarget::BufferReference(name) => {
                block.kind == BlockKind::BufferReference && is_block_name(&block.name, name)
            }
        }
    }
}

/// Fails unless each layout is equal to the blocks of the shaders that it is for, and there is one.
pub(super) fn check_layouts<'a>(
    pipeline: &str,
    layouts: &[BlockLayout],
    modules: impl Iterator<Item = &'a ShaderModule> + Clone,
) -> Result<()> {
    for layout in layouts {
        let mut blocks = BlockComparison::new(pipeline, &layout.layout);
        for module in modules.clone() {
            let own = module.reflection.blocks.list.iter().filter(|block| layout.is_for(block));
            own.into_iter().try_for_each(|block| blocks.compare(module, block))?;
        }
        if !blocks.finish()? {
            return Err(no_block_error(pipeline, layout, modules));
        }
    }
    Ok(())
}

/// The comparison of one Rust struct with the blocks of several stages.
pub(super) struct BlockComparison<'a> {
    pipeline: &'a str,
    layout: &'a StructLayout,
    /// The members that no block has yet, with the shader and the block compared last. `None` before the first block.
    missing: Option<(Vec<LayoutDifference>, String, String)>,
}

impl<'a> BlockComparison<'a> {
    pub(super) fn new(pipeline: &'a str, layout: &'a StructLayout) -> Self {
        Self { pipeline, layout, missing: None }
    }

    /// Compares the struct with a block of `module`.
    pub(super) fn compare(&mut self, module: &ShaderModule, block: &Block) -> Result<()> {
        let compared = compare_layout(self.layout, &module.reflection.blocks, block.ty);
        let mut compared = compared.map_err(|why| {
            let (block, layout) = (block_label(block), self.layout.name);
            let message =
                format!("the {block} of shader '{}' cannot be compared with {layout}: {why}", module.name);
            Error::usage(self.pipeline, message)
        })?;
        if !compared.differences.is_empty() {
            // A member of a wrong name is one that the struct lacks, and one that the block lacks.
            compared.differences.append(&mut compared.missing);
            return Err(self.mismatch(module.name.clone(), block_label(block), compared.differences));
        }
        let missing = match self.missing.take() {
            None => compared.missing,
            Some((before, ..)) => {
                before.into_iter().filter(|member| compared.missing.contains(member)).collect()
            }
        };
        self.missing = Some((missing, module.name.clone(), block_label(block)));
        Ok(())
    }

    /// Fails if no block has one of the members. Returns false if there was no block.
    pub(super) fn finish(self) -> Result<bool> {
        match &self.missing {
            None => Ok(false),
            Some((missing, ..)) if missing.is_empty() => Ok(true),
            Some((missing, shader, block)) => {
                Err(self.mismatch(shader.clone(), block.clone(), missing.clone()))
            }
        }
    }

    fn mismatch(&self, shader: String, block: String, differences: Vec<LayoutDifference>) -> Error {
        let (pipeline, struct_name) = (self.pipeline.to_owned(), self.layout.name);
        Error::LayoutMismatch { pipeline, shader, block, struct_name, differences }
    }
}

fn block_label(block: &Block) -> String {
    let kind = match block.kind {
        BlockKind::PushConstants => "push constants",
        BlockKind::ShaderRecord => "shader record",
        BlockKind::BufferReference => "buffer reference",
    };
    match block.name.as_str() {
        "" => kind.to_owned(),
        name => format!("{kind} '{name}'"),
    }
}

/// Returns the error for a layout whose block no shader has.
fn no_block_error<'a>(
    pipeline: &str,
    layout: &BlockLayout,
    modules: impl Iterator<Item = &'a ShaderModule>,
) -> Error {
    let struct_name = layout.layout.name;
    let message = match layout.target {
        BlockTarget::PushConstants => {
            format!("none of its shaders has push constants, for which the layout of {struct_name} was given")
        }
        BlockTarget::BufferReference(name) => {
            let blocks = modules.flat_map(|module| &module.reflection.blocks.list);
            let references = blocks.filter(|block| block.kind == BlockKind::BufferReference);
            let mut names: Vec<String> = references.map(|block| format!("'{}'", block.name)).collect();
            names.sort_unstable();
            names.dedup();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            format!(
                "none of its shaders has a buffer_reference block '{name}', for which the layout of {struct_name} was \
                 given; the blocks are {names}"
            )
        }
    };
    Error::usage(pipeline, message)
}
