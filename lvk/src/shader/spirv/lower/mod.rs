//! Lowers the shaders of a ray tracing pipeline to one compute shader, which traverses in software or by ray queries.

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
}

/// One shader of the pipeline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StageModule<'a> {
    /// Name in errors.
    pub(crate) name: &'a str,
    pub(crate) stage: ShaderStage,
    /// SPIR-V with the entry point `main`, validated and reflected.
    pub(crate) words: &'a [u32],
    /// Ids and bits of specialization constants. Ids that the module does not declare have no effect.
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
    /// All shaders, without duplicates of the same words and constants.
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

/// Values that a lowered pipeline reads at the address in its push constants, which are these 8 bytes only. The push
/// constants of the application follow at [`Launch::PUSH_CONSTANTS`].
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
    let shader = lowering.modules[lowering.ray_gen].name.to_owned();
    Err(LoweringError { shader, message: "not yet".to_owned() })
}
