//! The shader groups of a pipeline or library, and their modules.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use super::ray_tracing_desc::{HitGroup, RayTracingPipelineDesc};
use super::sbt_order::PerRegion;
use super::shader_module::{ModuleLookup, ShaderModule};
use crate::error::{Error, Result};
use crate::handle::ShaderModuleHandle;
use crate::shader::ShaderStage;

/// Properties of compiled shader groups that a pipeline needs, of its own groups or of a library's.
#[derive(Debug, Default)]
pub(crate) struct CompiledGroups {
    /// The caller's record bytes of each group.
    pub(crate) records: PerRegion<Vec<Box<[u8]>>>,
    /// Every shader of every group, with the group's number.
    pub(crate) shaders: Vec<(u32, ShaderStage)>,
    pub(crate) push_constant_bytes: u32,
}

impl CompiledGroups {
    /// Returns the number of groups of each region.
    pub(crate) fn counts(&self) -> PerRegion<usize> {
        self.records.as_ref().map(Vec::len)
    }

    /// Returns the number of all groups.
    pub(crate) fn len(&self) -> usize {
        self.counts().into_array().into_iter().sum()
    }
}

/// Shader groups about to be compiled.
#[derive(Default)]
pub(crate) struct ShaderGroups {
    /// Modules, without duplicates.
    pub(crate) modules: Vec<Arc<ShaderModule>>,
    pub(crate) infos: Vec<vk::RayTracingShaderGroupCreateInfoKHR<'static>>,
    pub(crate) list: CompiledGroups,
    places: HashMap<ShaderModuleHandle, u32>,
}

impl ShaderGroups {
    /// Collects the groups in the order of a shader binding table: ray generation, miss, hit, callable.
    pub(crate) fn collect(desc: &RayTracingPipelineDesc<'_>, find: ModuleLookup<'_>) -> Result<Self> {
        let mut groups = Self::default();
        for handle in desc.ray_gen {
            groups.add_general_group(*handle, ShaderStage::RayGen, find)?;
        }
        for handle in desc.miss {
            groups.add_general_group(*handle, ShaderStage::Miss, find)?;
        }
        for group in desc.hit_groups {
            groups.add_hit_group(group, find)?;
        }
        for handle in desc.callable {
            groups.add_general_group(*handle, ShaderStage::Callable, find)?;
        }
        let bytes = groups.modules.iter().map(|module| module.reflection.push_constant_bytes);
        groups.list.push_constant_bytes = bytes.max().unwrap_or(0);
        groups.list.records = collect_records(desc)?;
        Ok(groups)
    }

    /// Fails if a payload or hit attributes are larger than the limits of the description.
    pub(crate) fn check_sizes(&self, desc: &RayTracingPipelineDesc<'_>) -> Result<()> {
        for module in &self.modules {
            let sizes = module.reflection.ray_interface;
            let checked = [
                ("payload", sizes.payload_bytes, "max_payload_bytes", desc.max_payload_bytes),
                (
                    "hit attributes",
                    sizes.hit_attribute_bytes,
                    "max_hit_attribute_bytes",
                    desc.max_hit_attribute_bytes,
                ),
            ];
            if let Some((what, bytes, field, most)) = checked.iter().find(|(_, bytes, _, most)| bytes > most)
            {
                let message = format!(
                    "the {what} of shader '{}' has {bytes} bytes, more than {field}, which is {most}",
                    module.name
                );
                return Err(Error::usage(desc.debug_name, message));
            }
        }
        Ok(())
    }

    fn add_general_group(
        &mut self,
        handle: ShaderModuleHandle,
        stage: ShaderStage,
        find: ModuleLookup<'_>,
    ) -> Result<()> {
        let place = self.stage_index(Some(handle), stage, find)?;
        self.infos.push(group_info(vk::RayTracingShaderGroupTypeKHR::GENERAL).general_shader(place));
        Ok(())
    }

    fn add_hit_group(&mut self, desc: &HitGroup<'_>, find: ModuleLookup<'_>) -> Result<()> {
        let kind = match desc.intersection {
            Some(_) => vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP,
            None => vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP,
        };
        let hit = group_info(kind)
            .closest_hit_shader(self.stage_index(desc.closest_hit, ShaderStage::ClosestHit, find)?)
            .any_hit_shader(self.stage_index(desc.any_hit, ShaderStage::AnyHit, find)?)
            .intersection_shader(self.stage_index(desc.intersection, ShaderStage::Intersection, find)?);
        self.infos.push(hit);
        Ok(())
    }

    /// Returns the stage index of a module in the group being added. A module that is used again keeps its index.
    fn stage_index(
        &mut self,
        handle: Option<ShaderModuleHandle>,
        stage: ShaderStage,
        find: ModuleLookup<'_>,
    ) -> Result<u32> {
        let Some(handle) = handle else { return Ok(vk::SHADER_UNUSED_KHR) };
        let module = find(handle)?;
        module.check_stage(stage)?;
        self.list.shaders.push((self.infos.len() as u32, stage));
        let next = self.modules.len() as u32;
        let place = *self.places.entry(handle).or_insert(next);
        if place == next {
            self.modules.push(module);
        }
        Ok(place)
    }
}

fn group_info(kind: vk::RayTracingShaderGroupTypeKHR) -> vk::RayTracingShaderGroupCreateInfoKHR<'static> {
    vk::RayTracingShaderGroupCreateInfoKHR::default()
        .ty(kind)
        .general_shader(vk::SHADER_UNUSED_KHR)
        .closest_hit_shader(vk::SHADER_UNUSED_KHR)
        .any_hit_shader(vk::SHADER_UNUSED_KHR)
        .intersection_shader(vk::SHADER_UNUSED_KHR)
}

fn collect_records(desc: &RayTracingPipelineDesc<'_>) -> Result<PerRegion<Vec<Box<[u8]>>>> {
    let name = desc.debug_name;
    Ok(PerRegion {
        ray_gen: pad_records(name, "ray generation", desc.ray_gen.len(), desc.ray_gen_records)?,
        miss: pad_records(name, "miss", desc.miss.len(), desc.miss_records)?,
        hit: desc.hit_groups.iter().map(|group| group.record.into()).collect(),
        callable: pad_records(name, "callable", desc.callable.len(), desc.callable_records)?,
    })
}

/// Returns one record for each shader. Missing records are empty.
fn pad_records(pipeline: &str, kind: &str, shaders: usize, records: &[&[u8]]) -> Result<Vec<Box<[u8]>>> {
    if records.len() > shaders {
        let message =
            format!("{} records for {shaders} {kind} shaders; give each at most one", records.len());
        return Err(Error::usage(pipeline, message));
    }
    let mut all: Vec<Box<[u8]>> = records.iter().map(|record| (*record).into()).collect();
    all.resize_with(shaders, Box::default);
    Ok(all)
}
