//! The library's own compute shaders. Their SPIR-V is kept beside their GLSL, so that no compiler is needed.

use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use bytemuck::{Pod, Zeroable};

use crate::error::Result;
use crate::gpu::Gpu;
use crate::pipeline::compute::ComputePipelineDesc;
use crate::pipeline::{ComputePipeline, PipelineBase, PipelineLayout, ShaderModule};
use crate::shader::{ShaderModuleDesc, ShaderSource, ShaderStage};

/// Invocations of a workgroup of every kernel.
pub(crate) const GROUP_SIZE: u32 = 64;

/// Which of the library's compute shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernel {
    /// Gathers the indices or boxes of a part of a mesh.
    Gather,
    /// Puts addresses into instances and writes their rows.
    Instances,
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
#[derive(Default)]
pub(crate) struct Kernels {
    made: Mutex<[Option<Arc<ComputePipeline>>; 2]>,
}

impl Kernels {
    /// The pipeline of a kernel.
    pub(crate) fn get(
        &self,
        gpu: &Arc<Gpu>,
        layout: &PipelineLayout,
        cache: vk::PipelineCache,
        kernel: Kernel,
    ) -> Result<Arc<ComputePipeline>> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        let place = &mut made[kernel as usize];
        match place {
            Some(pipeline) => Ok(Arc::clone(pipeline)),
            None => Ok(Arc::clone(place.insert(Arc::new(kernel.pipeline(gpu, layout, cache)?)))),
        }
    }
}

impl Kernel {
    fn name(self) -> &'static str {
        match self {
            Self::Gather => "lvk gather kernel",
            Self::Instances => "lvk instances kernel",
        }
    }

    fn spirv(self) -> Vec<u32> {
        let bytes: &[u8] = match self {
            Self::Gather => include_bytes!("gather.comp.spv"),
            Self::Instances => include_bytes!("instances.comp.spv"),
        };
        bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
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
        let module = ShaderModule::new(gpu, &desc, layout.push_constant_bytes)?;
        let desc = ComputePipelineDesc { debug_name: self.name(), ..Default::default() };
        ComputePipeline::new(gpu, PipelineBase { layout: layout.raw, cache }, &desc, &module)
    }
}

/// Workgroups along x and y for so many invocations, within what every device takes along an axis. The shader finds
/// its invocation by both.
pub(crate) fn groups(invocations: u32) -> [u32; 3] {
    const MOST: u32 = 65_535;
    let groups = invocations.div_ceil(GROUP_SIZE).max(1);
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

    /// `LVK_UPDATE_KERNELS=1 cargo test -p lvk kernel` writes the words anew.
    #[cfg(feature = "glsl")]
    #[test]
    fn the_words_are_those_of_the_source() {
        for (kernel, name, text) in [
            (Kernel::Gather, "gather", include_str!("gather.comp.glsl")),
            (Kernel::Instances, "instances", include_str!("instances.comp.glsl")),
        ] {
            let desc = ShaderModuleDesc {
                stage: ShaderStage::Compute,
                source: ShaderSource::Glsl(text),
                debug_name: name,
                ..Default::default()
            };
            let words = crate::shader::compile(&desc, &Default::default()).unwrap();
            if std::env::var("LVK_UPDATE_KERNELS").is_ok() {
                let path = format!("{}/src/kernel/{name}.comp.spv", env!("CARGO_MANIFEST_DIR"));
                std::fs::write(path, bytemuck::cast_slice::<u32, u8>(&words)).unwrap();
            } else {
                assert!(words == kernel.spirv(), "{name}: set LVK_UPDATE_KERNELS=1 once");
            }
        }
    }
}
