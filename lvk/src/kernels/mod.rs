//! The library's own compute shaders. Their SPIR-V is kept beside their GLSL, so that no compiler is needed.

use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::lock_order::{Mutex, Rank};
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::{ComputePipeline, PipelineBase, PipelineLayout, ShaderModule};
use crate::shader::{ShaderModuleDesc, ShaderSource, ShaderStage};

/// Invocations of a workgroup of the kernels that prepare inputs.
pub(crate) const GROUP_SIZE: u32 = 64;

/// Every kernel: its name, the stem of its SPIR-V, and the pieces of its GLSL, which are read one behind the other.
macro_rules! kernels {
    ($($(#[$doc:meta])* $name:ident = $file:literal, [$($piece:literal),*];)*) => {
        /// Which of the library's compute shaders.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        pub(crate) enum Kernel {
            $($(#[$doc])* $name,)*
        }

        impl Kernel {
            pub(crate) const ALL: &'static [Self] = &[$(Self::$name),*];

            pub(crate) fn name(self) -> &'static str {
                match self {
                    $(Self::$name => concat!("lvk kernel ", $file),)*
                }
            }

            fn bytes(self) -> &'static [u8] {
                match self {
                    $(Self::$name => include_bytes!(concat!($file, ".comp.spv")),)*
                }
            }

            /// Where the words lie, and the pieces they come from.
            #[cfg(all(test, feature = "glsl"))]
            fn source(self) -> (&'static str, &'static [&'static str]) {
                match self {
                    $(Self::$name => ($file, &[$($piece),*]),)*
                }
            }
        }
    };
}

kernels! {
    /// Gathers the indices or boxes of a part of a mesh.
    Gather = "gather", ["gather.comp.glsl"];
    /// Puts addresses into instances and writes their rows.
    Instances = "instances", ["instances.comp.glsl"];
    /// Forgets what an earlier build left in the scratch memory.
    BuildReset = "build/reset", ["build/job.glsl", "build/reset.comp.glsl"];
    /// Boxes of triangles and boxes.
    BuildPrimitives = "build/primitives",
        ["build/job.glsl", "build/box.glsl", "build/bounds.glsl", "build/input.glsl", "build/primitives.comp.glsl"];
    /// Boxes of instances, and the instances as the structure keeps them.
    BuildInstances = "build/instances",
        ["build/job.glsl", "build/box.glsl", "build/bounds.glsl", "build/instance.glsl", "build/instances.comp.glsl"];
    /// Codes of places.
    BuildCodes = "build/codes", ["build/job.glsl", "build/box.glsl", "build/code.glsl", "build/codes.comp.glsl"];
    /// Counts digits of codes.
    SortCount = "build/sort_count", ["build/job.glsl", "build/rank.glsl", "build/sort_count.comp.glsl"];
    /// Sums the counts.
    SortScan = "build/sort_scan", ["build/job.glsl", "build/rank.glsl", "build/sort_scan.comp.glsl"];
    /// Moves codes to where they belong.
    SortScatter = "build/sort_scatter", ["build/job.glsl", "build/rank.glsl", "build/sort_scatter.comp.glsl"];
    /// The hierarchy.
    BuildTree = "build/tree",
        ["build/job.glsl", "build/arrivals.glsl", "build/tree.glsl", "build/tree.comp.glsl"];
    /// No child has arrived at any node.
    ResetArrivals = "build/arrivals", ["build/job.glsl", "build/arrivals.glsl", "build/arrivals.comp.glsl"];
    /// Boxes of binary nodes, and better places for them.
    BuildImprove = "build/improve",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/leaf.glsl", "build/kept_input.glsl",
         "build/arrivals.glsl", "build/node.glsl", "build/rotate.glsl", "build/fit.glsl", "build/improve.comp.glsl"];
    /// A level of wide nodes, of binary ones.
    Collapse = "build/collapse",
        ["build/job.glsl", "build/box.glsl", "build/leaf.glsl", "build/kept_input.glsl", "build/node.glsl",
         "build/wide.glsl", "build/encode.glsl", "build/collapse.glsl", "build/collapse.comp.glsl"];
    /// Everything of a bottom-level structure but its nodes.
    Place = "build/place",
        ["build/job.glsl", "build/box.glsl", "build/input.glsl", "build/leaf.glsl", "build/leaf_write.glsl",
         "build/arrivals.glsl", "build/node.glsl", "build/wide.glsl", "build/packed.glsl", "build/place.glsl",
         "build/place.comp.glsl"];
    /// Boxes of wide nodes, where there was no room for those made of binary ones.
    FitPacked = "build/fit_packed",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/leaf.glsl", "build/kept_any.glsl",
         "build/arrivals.glsl", "build/node.glsl", "build/wide.glsl", "build/encode.glsl", "build/packed.glsl",
         "build/fit_wide.glsl", "build/fit_packed.comp.glsl"];
    /// Boxes of binary nodes.
    FitBinary = "build/fit",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/leaf.glsl", "build/kept_any.glsl",
         "build/arrivals.glsl", "build/node.glsl", "build/no_rotation.glsl", "build/fit.glsl", "build/fit.comp.glsl"];
    /// Boxes of wide nodes.
    FitWide = "build/fit_wide",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/leaf.glsl", "build/kept_any.glsl",
         "build/wide.glsl", "build/encode.glsl", "build/fit_wide.glsl", "build/fit_wide.comp.glsl"];
    /// Primitives of leaves from inputs that moved.
    RefitLeaves = "build/refit",
        ["build/job.glsl", "build/box.glsl", "build/input.glsl", "build/leaf.glsl", "build/leaf_write.glsl",
         "build/arrivals.glsl", "build/wide.glsl", "build/refit.glsl", "build/refit.comp.glsl"];
    /// The binary tree of a whole bottom-level structure by one workgroup.
    BuildSmallBlas = "build/small_blas",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/bounds.glsl", "build/input.glsl",
         "build/code.glsl", "build/rank.glsl", "build/leaf.glsl", "build/kept_input.glsl", "build/arrivals.glsl",
         "build/tree.glsl", "build/node.glsl", "build/rotate.glsl", "build/fit.glsl", "build/meet.glsl",
         "build/small_blas.comp.glsl", "build/small.glsl"];
    /// The rest of such a structure by one workgroup.
    BuildSmallWide = "build/small_wide",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/input.glsl", "build/leaf.glsl",
         "build/kept_any.glsl", "build/leaf_write.glsl", "build/arrivals.glsl", "build/node.glsl", "build/wide.glsl",
         "build/encode.glsl", "build/collapse.glsl", "build/packed.glsl", "build/place.glsl", "build/fit_wide.glsl",
         "build/meet.glsl", "build/small_wide.comp.glsl"];
    /// A whole top-level structure by one workgroup.
    BuildSmallTlas = "build/small_tlas",
        ["build/shared.glsl", "build/job.glsl", "build/box.glsl", "build/bounds.glsl", "build/instance.glsl",
         "build/code.glsl", "build/rank.glsl", "build/leaf.glsl", "build/kept_input.glsl", "build/arrivals.glsl",
         "build/tree.glsl", "build/node.glsl", "build/rotate.glsl", "build/fit.glsl", "build/meet.glsl",
         "build/small_tlas.comp.glsl", "build/small.glsl"];
}

/// Push constants of [`Kernel::Gather`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct GatherPush {
    pub(crate) numbers: u64,
    pub(crate) source: u64,
    pub(crate) gathered: u64,
    pub(crate) count: u32,
    /// 0 no indices, 1 of 16 bits, 2 of 32 bits, 3 boxes.
    pub(crate) kind: u32,
    pub(crate) odd_half: u32,
    pub(crate) box_stride: u32,
}

/// Push constants of [`Kernel::Instances`].
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub(crate) struct InstancesPush {
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
    /// Fills the block to the alignment of its addresses.
    pub(crate) unused: u32,
}

/// The pipelines, each made when first needed.
pub(crate) struct Kernels {
    made: [Mutex<Option<Arc<ComputePipeline>>>; Kernel::ALL.len()],
}

impl Kernels {
    pub(crate) fn new() -> Self {
        Self { made: [const { Mutex::new(Rank::Kernels, None) }; Kernel::ALL.len()] }
    }

    /// The pipeline of a kernel.
    pub(crate) fn get(
        &self,
        gpu: &Arc<Gpu>,
        layout: &PipelineLayout,
        cache: vk::PipelineCache,
        kernel: Kernel,
    ) -> Result<Arc<ComputePipeline>> {
        let mut place = self.made[kernel as usize].lock();
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
        let module = ShaderModule::new(gpu, &desc, None, None, layout.push_constant_bytes)?;
        let desc = ComputePipelineDesc { debug_name: self.name(), ..Default::default() };
        ComputePipeline::new(gpu, PipelineBase { layout: layout.raw, cache }, &desc, &module)
    }
}

/// Workgroups along x and y for so many invocations; see [`spread`].
pub(crate) fn groups(invocations: u32) -> [u32; 3] {
    spread(invocations.div_ceil(GROUP_SIZE))
}

/// At least so many workgroups, and one, along x and y, within what every device takes along an axis. The shader finds
/// its number by both.
pub(crate) fn spread(groups: u32) -> [u32; 3] {
    const MOST: u32 = 65_535;
    let groups = groups.max(1);
    let y = groups.div_ceil(MOST);
    [groups.div_ceil(y), y, 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_invocation_has_a_group() {
        for invocations in [0, 1, 64, 65, 4_194_240, 4_194_241, 100_000_000, u32::MAX] {
            let [x, y, z] = groups(invocations);
            assert!(x <= 65_535 && y <= 65_535 && z == 1);
            assert!(u64::from(x) * u64::from(y) * u64::from(GROUP_SIZE) >= u64::from(invocations));
        }
    }

    /// Compares the words of a file with its source, or writes them anew.
    #[cfg(feature = "glsl")]
    fn expect_words(path: &std::path::Path, text: &str) {
        let desc = ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source: ShaderSource::Glsl(text),
            debug_name: path.to_str().unwrap(),
            ..Default::default()
        };
        let words = crate::shader::compile(&desc, &Default::default(), None)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
            std::fs::write(path, bytes).unwrap();
        } else {
            let same = std::fs::read(path).is_ok_and(|kept| kept == bytes);
            assert!(same, "{}: set LVK_UPDATE_KERNELS=1 once", path.display());
        }
    }

    /// `LVK_UPDATE_KERNELS=1 cargo test -p lvk kernel` writes the words anew.
    #[cfg(feature = "glsl")]
    #[test]
    fn the_words_are_those_of_the_source() {
        let crate_folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let folder = crate_folder.join("src/kernel");
        let read = |path: &std::path::Path| std::fs::read_to_string(path).unwrap();
        for kernel in Kernel::ALL {
            let (file, pieces) = kernel.source();
            let text: String = pieces.iter().map(|piece| read(&folder.join(piece))).collect();
            expect_words(&folder.join(format!("{file}.comp.spv")), &text);
        }
        let tests = crate_folder.join("tests");
        expect_words(&tests.join("spirv_only.comp.spv"), &read(&tests.join("spirv_only.comp.glsl")));
    }
}
