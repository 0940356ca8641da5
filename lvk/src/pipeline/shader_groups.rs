//! The shader groups of a pipeline or library, and their modules.

use std::collections::HashMap;
use std::sync::Arc;

use ash::vk;

use super::block_layout::check_layouts;
use super::ray_tracing_desc::{HitGroup, RayTracingPipelineDesc};
use super::sbt_order::PerRegion;
use super::shader_module::{ModuleLookup, ShaderModule};
use super::shader_record::ShaderRecord;
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
        check_layouts(desc.debug_name, desc.layouts, groups.modules.iter().map(|module| &**module))?;
        groups.list.records = collect_records(desc, find)?;
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

/// Checks the records of all groups, and returns their bytes.
fn collect_records(
    desc: &RayTracingPipelineDesc<'_>,
    find: ModuleLookup<'_>,
) -> Result<PerRegion<Vec<Box<[u8]>>>> {
    let general = |kind: &str, shaders: &[ShaderModuleHandle], records: &[ShaderRecord<'_>]| {
        if records.len() > shaders.len() {
            let (records, shaders) = (records.len(), shaders.len());
            let message = format!("{records} records for {shaders} {kind} shaders; give each at most one");
            return Err(Error::usage(desc.debug_name, message));
        }
        let given = records.iter().copied().chain(std::iter::repeat(ShaderRecord::default()));
        let record = |(index, (shader, record)): (usize, (&ShaderModuleHandle, ShaderRecord<'_>))| {
            record.check(desc.debug_name, &format!("{kind} shader {index}"), &[find(*shader)?])?;
            Ok(record.bytes().into())
        };
        shaders.iter().zip(given).enumerate().map(record).collect()
    };
    let hit_group = |(index, group): (usize, &HitGroup<'_>)| {
        let shaders = [group.closest_hit, group.any_hit, group.intersection];
        let modules = shaders.into_iter().flatten().map(find).collect::<Result<Vec<_>>>()?;
        group.record.check(desc.debug_name, &format!("hit group {index}"), &modules)?;
        Ok(group.record.bytes().into())
    };
    Ok(PerRegion {
        ray_gen: general("ray generation", desc.ray_gen, desc.ray_gen_records)?,
        miss: general("miss", desc.miss, desc.miss_records)?,
        hit: desc.hit_groups.iter().enumerate().map(hit_group).collect::<Result<_>>()?,
        callable: general("callable", desc.callable, desc.callable_records)?,
    })
}
