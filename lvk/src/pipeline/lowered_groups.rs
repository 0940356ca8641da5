//! The shader groups of a lowered pipeline, its own and those of its libraries, by their index in the table.

use std::sync::Arc;

use ash::vk;

use super::ray_tracing_desc::RayTracingPipelineDesc;
use super::shader_groups::ShaderGroups;
use super::shader_module::ShaderModule;
use super::stage::Specialization;
use crate::error::Result;
use crate::shader::spirv::lower::HitShaders;

/// The shaders of one part of a lowered pipeline: its own, or those of a library. Indices are those of `modules`.
pub(crate) struct LoweredPart<M = Arc<ShaderModule>> {
    modules: Vec<M>,
    ray_gen: Vec<usize>,
    miss: Vec<usize>,
    hit: Vec<HitShaders>,
    callable: Vec<usize>,
    /// Ids and bits of the specialization constants of the part.
    specialization: Vec<(u32, u64)>,
}

impl LoweredPart {
    /// Returns the shaders of `groups`. Fails unless a shader declares each specialization constant.
    pub(super) fn new(desc: &RayTracingPipelineDesc<'_>, groups: &ShaderGroups) -> Result<Self> {
        let modules = groups.modules.iter().map(|module| &**module);
        Specialization::new(desc.debug_name, desc.specialization, modules)?;
        let counts = groups.list.counts();
        let (ray_gen, rest) = groups.infos.split_at(counts.ray_gen.min(groups.infos.len()));
        let (miss, rest) = rest.split_at(counts.miss.min(rest.len()));
        let (hit, callable) = rest.split_at(counts.hit.min(rest.len()));
        let general = |infos: &[vk::RayTracingShaderGroupCreateInfoKHR<'_>]| {
            infos.iter().filter_map(|info| used(info.general_shader)).collect()
        };
        Ok(Self {
            modules: groups.modules.clone(),
            ray_gen: general(ray_gen),
            miss: general(miss),
            hit: hit.iter().map(hit_shaders).collect(),
            callable: general(callable),
            specialization: desc
                .specialization
                .iter()
                .map(|constant| (constant.id, constant.value.bits()))
                .collect(),
        })
    }
}

/// All shaders of a pipeline. Indices are those of `modules`.
pub(super) struct LinkedGroups<'a, M> {
    /// Each module with the constants of its part, without duplicates of both.
    pub(super) modules: Vec<(&'a M, &'a [(u32, u64)])>,
    pub(super) ray_gen: Vec<usize>,
    pub(super) miss: Vec<usize>,
    pub(super) hit: Vec<HitShaders>,
    pub(super) callable: Vec<usize>,
}

impl<M> LinkedGroups<'_, M> {
    /// Returns the ray generation shaders without duplicates.
    pub(super) fn distinct_ray_gens(&self) -> Vec<usize> {
        let mut distinct = self.ray_gen.clone();
        distinct.sort_unstable();
        distinct.dedup();
        distinct
    }
}

impl LinkedGroups<'_, Arc<ShaderModule>> {
    /// Returns the bytes of push constants that the shaders read.
    pub(super) fn push_constant_bytes(&self) -> u32 {
        let bytes = self.modules.iter().map(|(module, _)| module.reflection.push_constant_bytes);
        bytes.max().unwrap_or(0)
    }
}

/// Links the parts of a pipeline: its own first, then its libraries, region by region as in the shader binding table.
pub(super) fn link<'a, M>(
    parts: &[&'a LoweredPart<M>],
    is_same: impl Fn(&M, &M) -> bool,
) -> LinkedGroups<'a, M> {
    let mut linked = LinkedGroups {
        modules: Vec::new(),
        ray_gen: Vec::new(),
        miss: Vec::new(),
        hit: Vec::new(),
        callable: Vec::new(),
    };
    for part in parts {
        let constants = part.specialization.as_slice();
        let mut place = |module: &'a M| {
            let known = |other: &(&M, &[(u32, u64)])| is_same(other.0, module) && other.1 == constants;
            linked.modules.iter().position(known).unwrap_or_else(|| {
                linked.modules.push((module, constants));
                linked.modules.len() - 1
            })
        };
        let places: Vec<usize> = part.modules.iter().map(&mut place).collect();
        let moved = |index: usize| places.get(index).copied();
        linked.ray_gen.extend(part.ray_gen.iter().filter_map(|index| moved(*index)));
        linked.miss.extend(part.miss.iter().filter_map(|index| moved(*index)));
        linked.hit.extend(part.hit.iter().map(|group| HitShaders {
            closest_hit: group.closest_hit.and_then(moved),
            any_hit: group.any_hit.and_then(moved),
            intersection: group.intersection.and_then(moved),
        }));
        linked.callable.extend(part.callable.iter().filter_map(|index| moved(*index)));
    }
    linked
}

fn hit_shaders(info: &vk::RayTracingShaderGroupCreateInfoKHR<'_>) -> HitShaders {
    HitShaders {
        closest_hit: used(info.closest_hit_shader),
        any_hit: used(info.any_hit_shader),
        intersection: used(info.intersection_shader),
    }
}

/// Returns the index of a stage unless it is `VK_SHADER_UNUSED_KHR`.
fn used(stage: u32) -> Option<usize> {
    (stage != vk::SHADER_UNUSED_KHR).then_some(stage as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a part with modules named by numbers.
    fn part(modules: &[u32], ray_gen: &[usize], miss: &[usize], hit: &[usize]) -> LoweredPart<u32> {
        let group = |index: &usize| HitShaders { any_hit: Some(*index), ..HitShaders::default() };
        LoweredPart {
            modules: modules.to_vec(),
            ray_gen: ray_gen.to_vec(),
            miss: miss.to_vec(),
            hit: hit.iter().map(group).collect(),
            callable: Vec::new(),
            specialization: Vec::new(),
        }
    }

    #[test]
    fn libraries_follow_region_by_region_and_share_modules() {
        let own = part(&[7, 8], &[0], &[1, 1], &[]);
        let library = part(&[8, 9, 7], &[2], &[0], &[1]);
        let linked = link(&[&own, &library], |a, b| a == b);
        let names: Vec<u32> = linked.modules.iter().map(|(module, _)| **module).collect();
        assert_eq!(names, [7, 8, 9]);
        assert_eq!((&*linked.ray_gen, &*linked.miss), (&[0, 0][..], &[1, 1, 1][..]));
        assert_eq!(linked.hit[0].any_hit, Some(2));
        assert_eq!(linked.distinct_ray_gens(), [0]);
    }

    #[test]
    fn a_module_with_other_constants_is_another_shader() {
        let own = part(&[7], &[0], &[], &[]);
        let mut library = part(&[7], &[0], &[], &[]);
        library.specialization = vec![(3, 5)];
        let linked = link(&[&own, &library], |a, b| a == b);
        assert_eq!(linked.modules, [(&7, &[][..]), (&7, &[(3, 5)][..])]);
        assert_eq!(linked.distinct_ray_gens(), [0, 1]);
    }

    #[test]
    fn unused_stages_have_no_index() {
        assert_eq!((used(vk::SHADER_UNUSED_KHR), used(4)), (None, Some(4)));
    }
}
