//! Lowers the shaders of a ray tracing pipeline to one compute shader, which traverses in software or by ray queries.

mod assemble;
mod attributes;
mod block_loop;
mod block_pointers;
mod calls;
mod constants;
mod control_flow;
mod decorations;
mod demote;
mod donor;
mod emit;
mod flatten;
mod inline;
mod instruction;
mod judges;
mod linker;
mod liveness;
mod localize;
mod loop_headers;
mod module;
mod non_uniform;
mod passed;
mod pointer_bits;
mod promote;
mod prune;
mod push_constants;
mod sampled_images;
mod scopes;
mod shaders;
mod simplify;
mod slots;
mod split_structs;
mod stack_size;
mod stage;
mod structure_arguments;
mod switches;
mod traces;

use self::assemble::Assembly;
use self::donor::Donor;
use self::linker::Linker;
use self::non_uniform::decorate_non_uniform;
use self::passed::Passed;
use self::pointer_bits::keep_pointers_as_bits;
use self::shaders::Shaders;
use self::traces::TraceVariables;
use crate::shader::ShaderStage;

/// The implementation of the traversal in a lowered pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Traversal {
    /// Ray queries of the device.
    Query,
    /// The library's own traversal for GPUs.
    SoftwareGpu,
    /// The library's own traversal for devices that are CPUs.
    SoftwareCpu,
    /// As [`SoftwareCpu`](Self::SoftwareCpu), where gathers of 64 bits are as fast as those of 32.
    SoftwareCpuPairs,
}

/// One shader of the pipeline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StageModule<'a> {
    /// Name in errors.
    pub(crate) name: &'a str,
    pub(crate) stage: ShaderStage,
    /// SPIR-V with the entry point `main`, validated and reflected.
    pub(crate) words: &'a [u32],
    /// Ids and bits of specialization constants.
    pub(crate) specialization: &'a [(u32, u64)],
}

/// The shaders of a hit group, as indices in [`Lowering::modules`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub(crate) struct HitShaders {
    pub(crate) closest_hit: Option<usize>,
    pub(crate) any_hit: Option<usize>,
    pub(crate) intersection: Option<usize>,
}

/// Describes the compute shader of one ray generation shader of a pipeline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lowering<'a> {
    pub(crate) traversal: Traversal,
    /// True if SwiftShader compiles the shader.
    pub(crate) is_for_swiftshader: bool,
    /// All shaders, without duplicates.
    pub(crate) modules: &'a [StageModule<'a>],
    /// The ray generation shader, as an index in `modules`.
    pub(crate) ray_gen: usize,
    /// Miss shaders by their index in the shader binding table, as indices in `modules`.
    pub(crate) miss: &'a [usize],
    /// Hit groups by their index in the shader binding table.
    pub(crate) hit: &'a [HitShaders],
    /// Callable shaders by their index in the shader binding table, as indices in `modules`.
    pub(crate) callable: &'a [usize],
    /// Distances between the records of the table in bytes: of miss shaders, hit groups and callable shaders.
    pub(crate) strides: [u32; 3],
    /// Bytes of push constants that the shaders read.
    pub(crate) push_constant_bytes: u32,
    /// Offset of the launch's address in the push constants, in bytes.
    pub(crate) launch_offset: u32,
    pub(crate) max_recursion: u32,
    pub(crate) max_callable_depth: u32,
}

/// A shader that cannot be lowered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LoweringError {
    /// Name of the shader.
    pub(crate) shader: String,
    /// The instruction, and why it cannot be lowered.
    pub(crate) message: String,
}

/// Invocations of a workgroup of the compute shader: 64 along x.
///
/// A launch with height 1 and depth 1 takes 64 rays in a workgroup. The workgroups lie along x, and behind the last of a
/// row along y. Another launch takes 8 x 8 rays in a workgroup, and its workgroups lie like the rays.
pub(crate) const WORKGROUP_SIZE: u32 = 64;

/// Values that a lowered pipeline reads at the address in its push constants, at [`Lowering::launch_offset`]. A copy of
/// the push constants of the application follows at [`Launch::PUSH_CONSTANTS`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Launch {
    /// Width, height and depth in rays.
    pub(crate) size: [u32; 3],
    pub(crate) unused: u32,
    /// Address of the record of the ray generation shader.
    pub(crate) ray_gen: u64,
    /// Addresses of the first records of miss shaders, hit groups and callable shaders.
    pub(crate) regions: [u64; 3],
}

impl Launch {
    /// Offset of the application's push constants in bytes.
    pub(crate) const PUSH_CONSTANTS: u32 = size_of::<Self>() as u32;
}

/// Returns the words of a compute shader with the entry point `main`, which does all that the pipeline does for a launch
/// of one ray generation shader. Specialization constants have their values.
pub(crate) fn lower(lowering: &Lowering<'_>) -> Result<Vec<u32>, LoweringError> {
    let ray_gen = lowering.modules.get(lowering.ray_gen).map_or("", |module| module.name);
    let failed = |message| LoweringError { shader: ray_gen.to_owned(), message };
    let mut linker = Linker::new(VERSION_1_6);
    let mut shaders = Shaders::link(&mut linker, lowering)?;
    let needs = shaders.needs(&linker, lowering);
    let donor = Donor::link(&mut linker, lowering.traversal, needs).map_err(failed)?;
    linker.module.memory_model = memory_model();
    let uint = linker.uint();
    let callable_index = linker.private(uint);
    let mut variables = TraceVariables {
        donor: &donor,
        payloads: Passed::default(),
        callables: Passed::default(),
        callable_index,
    };
    let mut attributes = Passed::default();
    shaders.rewrite(&mut linker, lowering, &mut variables, &mut attributes)?;
    let main = Assembly::new(&mut linker, lowering, &shaders, variables, attributes).assemble()?;
    if lowering.is_for_swiftshader {
        keep_pointers_as_bits(&mut linker);
        decorate_non_uniform(&mut linker);
    }
    Ok(prune::finish(linker, main).words())
}

/// Version word of SPIR-V 1.6.
const VERSION_1_6: u32 = 0x0001_0600;

/// Returns the operands of the memory model, with 64-bit addresses.
fn memory_model() -> Vec<u32> {
    vec![::spirv::AddressingModel::PhysicalStorageBuffer64 as u32, ::spirv::MemoryModel::GLSL450 as u32]
}

#[cfg(all(test, feature = "glsl", feature = "software-ray-query"))]
mod tests;
