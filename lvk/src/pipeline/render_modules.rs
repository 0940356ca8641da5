//! The shader modules of a graphics pipeline.

use std::sync::Arc;

use super::graphics_desc::RenderPipelineDesc;
use super::pipeline_part::Part;
use super::shader_module::{ModuleLookup, ShaderModule};
use crate::barrier::Stages;
use crate::error::Result;
use crate::handle::ShaderModuleHandle;
use crate::shader::ShaderStage;

/// The shader modules of a graphics pipeline.
pub(super) struct RenderModules {
    pub(super) vertex: Option<Arc<ShaderModule>>,
    pub(super) task: Option<Arc<ShaderModule>>,
    pub(super) mesh: Option<Arc<ShaderModule>>,
    pub(super) tess_control: Option<Arc<ShaderModule>>,
    pub(super) tess_eval: Option<Arc<ShaderModule>>,
    pub(super) geometry: Option<Arc<ShaderModule>>,
    pub(super) fragment: Option<Arc<ShaderModule>>,
}

impl RenderModules {
    pub(super) fn resolve(desc: &RenderPipelineDesc<'_>, find: ModuleLookup<'_>) -> Result<Self> {
        let find = |handle: Option<ShaderModuleHandle>| handle.map(find).transpose();
        Ok(Self {
            vertex: find(desc.vertex)?,
            task: find(desc.task)?,
            mesh: find(desc.mesh)?,
            tess_control: find(desc.tess_control)?,
            tess_eval: find(desc.tess_eval)?,
            geometry: find(desc.geometry)?,
            fragment: find(desc.fragment)?,
        })
    }

    /// Returns the modules of a part of the pipeline.
    pub(super) fn of_part(&self, part: Part) -> Self {
        let if_in = |of, module: &Option<Arc<ShaderModule>>| module.clone().filter(|_| part == of);
        Self {
            vertex: if_in(Part::PreRaster, &self.vertex),
            task: if_in(Part::PreRaster, &self.task),
            mesh: if_in(Part::PreRaster, &self.mesh),
            tess_control: if_in(Part::PreRaster, &self.tess_control),
            tess_eval: if_in(Part::PreRaster, &self.tess_eval),
            geometry: if_in(Part::PreRaster, &self.geometry),
            fragment: if_in(Part::Fragment, &self.fragment),
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &ShaderModule> + Clone {
        let before = [&self.vertex, &self.task, &self.mesh, &self.tess_control, &self.tess_eval];
        before.into_iter().chain([&self.geometry, &self.fragment]).filter_map(Option::as_deref)
    }

    /// Returns the stages of the pipeline that run ray queries.
    pub(super) fn query_stages(&self) -> Stages {
        let stage = |module: &ShaderModule| match module.stage {
            ShaderStage::Fragment => Stages::FRAGMENT,
            _ => Stages::PRE_RASTER,
        };
        self.iter().filter(|module| module.reflection.ray_query).map(stage).collect()
    }
}
