//! The library's own compute shaders. Their SPIR-V is stored beside their GLSL, so that no compiler is needed.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::{ComputePipeline, PipelineBase, PipelineLayout, ShaderModule};
use crate::shader::{CompileFiles, ShaderModuleDesc, ShaderSource, ShaderStage};

/// Invocations of a workgroup of the kernels that prepare inputs.
pub(crate) const GROUP_SIZE: u32 = 64;

/// Declares every kernel: its name, the path of its SPIR-V below `src` without the extension, and the GLSL files of the
/// same folder, without `.glsl`, that are concatenated to its source. A group of kernels is compiled if its `cfg` holds.
macro_rules! kernels {
    ($(#[cfg($when:meta)] { $($(#[$doc:meta])* $name:ident = $file:literal, $pieces:literal;)* })*) => {
        /// The library's compute shaders.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub(crate) enum Kernel {
            $($($(#[$doc])* #[cfg($when)] $name,)*)*
        }

        impl Kernel {
            pub(crate) const ALL: &'static [Self] = &[$($(#[cfg($when)] Self::$name,)*)*];

            pub(crate) fn name(self) -> &'static str {
                match self {
                    $($(#[cfg($when)] Self::$name => concat!("lvk ", $file),)*)*
                }
            }

            fn bytes(self) -> &'static [u8] {
                match self {
                    $($(#[cfg($when)] Self::$name => include_bytes!(concat!("../", $file, ".comp.spv")),)*)*
                }
            }

            /// Returns the path of the SPIR-V, and the files of the source.
            #[cfg(all(test, feature = "glsl"))]
            fn source(self) -> (&'static str, &'static str) {
                match self {
                    $($(#[cfg($when)] Self::$name => ($file, $pieces),)*)*
                }
            }
        }
    };
}

kernels! {
    #[cfg(all())] {
        /// Gathers the indices or AABBs of a part of a mesh.
        Gather = "kernels/gather", "gather.comp";
        /// Writes addresses and hit remap entries of instances.
        Instances = "kernels/instances", "instances.comp";
        /// Writes the size of a lowered trace, and its workgroup counts.
        TraceSize = "kernels/trace_size", "trace_size.comp";
    }
    #[cfg(feature = "software-ray-query")] {
        /// Resets the scratch memory after an earlier build.
        BuildReset = "software_ray_query/kernels/reset", "build_params reset.comp";
        /// Computes the bounds of triangles and AABBs.
        BuildPrimitives = "software_ray_query/kernels/primitives", "build_params box bounds input primitives.comp";
        /// Computes the bounds of instances, and writes the instance records of the TLAS.
        BuildInstances = "software_ray_query/kernels/instances", "build_params box bounds instance instances.comp";
        /// Computes the Morton codes of primitives.
        BuildCodes = "software_ray_query/kernels/codes", "build_params box code codes.comp";
        /// Counts the digits of codes.
        SortCount = "software_ray_query/kernels/sort_count", "build_params sort_keys sort_count.comp";
        /// Sums the counts.
        SortScan = "software_ray_query/kernels/sort_scan", "build_params sort_keys prefix_sum sort_scan.comp";
        /// Moves codes to their sorted positions.
        SortScatter = "software_ray_query/kernels/sort_scatter", "build_params sort_keys prefix_sum rank sort_scatter.comp";
        /// Builds binary trees from sorted codes.
        BuildClusters = "software_ray_query/kernels/cluster",
            "cluster_group shared build_params box leaf leaf_bounds_scratch node prefix decision decide workgroup_barrier \
             cluster cluster.comp";
        /// Collapses binary nodes to one level of wide nodes.
        Collapse = "software_ray_query/kernels/collapse",
            "build_params box leaf leaf_bounds_scratch node decision wide encode collapse \
             collapse.comp";
        /// Writes all parts of a BLAS except its nodes.
        WriteBlas = "software_ray_query/kernels/blas_write",
            "build_params box input leaf leaf_write arrival_counters node wide packed blas_write \
             blas_write.comp";
        /// Fits the bounds of packed wide nodes, which replace collapsed nodes that did not fit.
        FitPacked = "software_ray_query/kernels/fit_packed",
            "shared build_params box leaf leaf_bounds arrival_counters node wide encode packed fit_wide \
             fit_packed.comp";
        /// Fits the bounds of binary nodes.
        FitBinary = "software_ray_query/kernels/fit",
            "shared build_params box leaf leaf_bounds arrival_counters node fit fit.comp";
        /// Fits the bounds of wide nodes.
        FitWide = "software_ray_query/kernels/fit_wide",
            "shared build_params box leaf leaf_bounds wide encode fit_wide fit_wide.comp";
        /// Rewrites the primitives of leaves from moved inputs.
        RefitLeaves = "software_ray_query/kernels/refit",
            "build_params box input leaf leaf_write arrival_counters wide refit refit.comp";
        /// Sorts the primitives of a whole BLAS by one workgroup.
        BuildSmallBlas = "software_ray_query/kernels/small_blas",
            "shared small_digits build_params box bounds input code sort_keys prefix_sum rank workgroup_barrier \
             small_blas.comp small";
        /// Builds the rest of such a BLAS, after its binary tree, by one workgroup.
        BuildSmallWide = "software_ray_query/kernels/small_wide",
            "shared build_params box input leaf leaf_bounds leaf_write arrival_counters node decision wide encode \
             collapse packed blas_write fit_wide workgroup_barrier small_wide.comp";
        /// Sorts the instances of a whole TLAS by one workgroup.
        BuildSmallTlas = "software_ray_query/kernels/small_tlas",
            "shared small_digits build_params box bounds instance code sort_keys prefix_sum rank workgroup_barrier \
             small_tlas.comp small";
    }
}

/// Push constants of [`Kernel::Gather`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GatherPushConstants {
    pub(crate) numbers: u64,
    pub(crate) source: u64,
    pub(crate) gathered: u64,
    pub(crate) count: u32,
    /// 0: no indices, 1: 16-bit indices, 2: 32-bit indices, 3: AABBs.
    pub(crate) kind: u32,
    pub(crate) odd_half: u32,
    pub(crate) box_stride: u32,
}

/// Push constants of [`Kernel::Instances`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct InstancesPushConstants {
    pub(crate) source: u64,
    pub(crate) target: u64,
    pub(crate) rows: u64,
    pub(crate) entries: u64,
    pub(crate) parts: u64,
    pub(crate) owners: u64,
    pub(crate) count: u32,
    pub(crate) copies: u32,
    pub(crate) entry_count: u32,
    pub(crate) user_count: u32,
    pub(crate) keep_active: u32,
    /// Pads the block to the alignment of its addresses.
    pub(crate) unused: u32,
}

/// Push constants of [`Kernel::TraceSize`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct TraceSizePushConstants {
    /// Address of the caller's width, height and depth.
    pub(crate) arguments: u64,
    /// Address at which the workgroup counts are written, three `u32`.
    pub(crate) workgroups: u64,
    /// Address at which the size is written, three `u32`.
    pub(crate) size: u64,
    /// Largest workgroup count along x.
    pub(crate) max_workgroups: u32,
    /// Pads the block to the alignment of its addresses.
    pub(crate) unused: u32,
}

/// The pipelines of the kernels, each created at its first use.
pub(crate) struct Kernels {
    pipelines: [Mutex<Option<Arc<ComputePipeline>>>; Kernel::ALL.len()],
}

impl Kernels {
    pub(crate) fn new() -> Self {
        Self { pipelines: [const { Mutex::new(Rank::Kernels, None) }; Kernel::ALL.len()] }
    }

    /// Returns the pipeline of a kernel.
    pub(crate) fn pipeline_of(
        &self,
        gpu: &Arc<Gpu>,
        layout: &PipelineLayout,
        cache: vk::PipelineCache,
        kernel: Kernel,
    ) -> Result<Arc<ComputePipeline>> {
        let mut place = self.pipelines[kernel as usize].lock();
        match &*place {
            Some(pipeline) => Ok(Arc::clone(pipeline)),
            None => Ok(Arc::clone(place.insert(Arc::new(kernel.pipeline(gpu, layout, cache)?)))),
        }
    }
}

impl Kernel {
    fn spirv(self) -> Vec<u32> {
        let words = self.bytes().chunks_exact(4);
        words.map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
    }

    fn pipeline(
        self,
        gpu: &Arc<Gpu>,
        layout: &PipelineLayout,
        cache: vk::PipelineCache,
    ) -> Result<ComputePipeline> {
        let words = self.spirv();
        let desc = ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Spirv(&words),
            debug_name: self.name(),
            ..Default::default()
        };
        let module =
            ShaderModule::new(gpu, &desc, CompileFiles::default(), None, layout.push_constant_bytes)?;
        let desc = ComputePipelineDesc { debug_name: self.name(), ..Default::default() };
        let push_constant_bytes = layout.push_constant_bytes;
        let base = PipelineBase { layout: layout.raw, push_constant_bytes, cache, max_threads: 1 };
        ComputePipeline::new(gpu, base, &desc, &module)
    }
}

/// Returns the workgroup counts along x and y for `invocations`; see [`spread_workgroups`].
pub(crate) fn workgroup_counts(invocations: u32) -> [u32; 3] {
    spread_workgroups(invocations.div_ceil(GROUP_SIZE))
}

/// Returns counts along x and y for at least `groups` workgroups, and at least one.
///
/// The counts are within the limit along an axis that every device supports. The shader computes its index from both.
pub(crate) fn spread_workgroups(groups: u32) -> [u32; 3] {
    const MAX_GROUPS: u32 = 65_535;
    let groups = groups.max(1);
    let y = groups.div_ceil(MAX_GROUPS);
    [groups.div_ceil(y), y, 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_invocation_has_a_group() {
        for invocations in [0, 1, 64, 65, 4_194_240, 4_194_241, 100_000_000, u32::MAX] {
            let [x, y, z] = workgroup_counts(invocations);
            assert!(x <= 65_535 && y <= 65_535 && z == 1);
            assert!(u64::from(x) * u64::from(y) * u64::from(GROUP_SIZE) >= u64::from(invocations));
        }
    }

    /// Compares the words of a file with its source, or rewrites them.
    #[cfg(feature = "glsl")]
    fn expect_words(path: &std::path::Path, text: &str) {
        let desc = ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Glsl(text),
            debug_name: path.to_str().unwrap(),
            ..Default::default()
        };
        let words = crate::shader::compile(&desc, &Default::default(), CompileFiles::default())
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
            std::fs::write(path, bytes).unwrap();
        } else {
            let same = std::fs::read(path).is_ok_and(|kept| kept == bytes);
            assert!(same, "{}: set LVK_UPDATE_KERNELS=1 once", path.display());
        }
    }

    /// `LVK_UPDATE_KERNELS=1 cargo test -p lvk kernel` rewrites the words.
    #[cfg(feature = "glsl")]
    #[test]
    fn the_words_are_those_of_the_source() {
        let crate_folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let sources = crate_folder.join("src");
        let read = |path: &std::path::Path| std::fs::read_to_string(path).unwrap();
        for kernel in Kernel::ALL {
            let (file, pieces) = kernel.source();
            let words = sources.join(format!("{file}.comp.spv"));
            let piece = |piece| read(&words.with_file_name(format!("{piece}.glsl")));
            let text: String = pieces.split(' ').map(piece).collect();
            expect_words(&words, &text);
        }
        let tests = crate_folder.join("tests");
        expect_words(&tests.join("spirv_only.comp.spv"), &read(&tests.join("spirv_only.comp.glsl")));
    }
}
