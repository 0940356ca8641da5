//! Descriptions of pipelines that own their parts, for creation after the caller's call has returned.

use std::sync::Arc;

use super::block_layout::BlockLayout;
use super::compute::ComputePipelineDesc;
use super::graphics_desc::{ColorTarget, RenderPipelineDesc, VertexAttribute, VertexBinding};
use super::ray_tracing_desc::{HitGroup, RayTracingPipelineDesc};
use super::shader_module::{ModuleLookup, ShaderModule};
use super::shader_record::ShaderRecord;
use super::stage::SpecializationConstant;
use crate::error::{Error, Result};
use crate::handle::{Handle, ShaderModuleHandle};
use crate::shader::shader_layout::StructLayout;

/// The modules of a pipeline. They stay alive although their handles may be destroyed.
pub(crate) struct OwnedModules(Vec<(ShaderModuleHandle, Arc<ShaderModule>)>);

impl OwnedModules {
    /// Finds the modules of a graphics pipeline.
    pub(crate) fn of_render(desc: &RenderPipelineDesc<'_>, find: ModuleLookup<'_>) -> Result<Self> {
        let stages = [desc.vertex, desc.task, desc.mesh, desc.tess_control, desc.tess_eval];
        Self::find(stages.into_iter().chain([desc.geometry, desc.fragment]).flatten(), find)
    }

    fn find(handles: impl IntoIterator<Item = ShaderModuleHandle>, find: ModuleLookup<'_>) -> Result<Self> {
        let found = handles.into_iter().map(|handle| Ok((handle, find(handle)?)));
        found.collect::<Result<Vec<_>>>().map(Self)
    }

    pub(crate) fn get(&self, handle: ShaderModuleHandle) -> Result<Arc<ShaderModule>> {
        let found = self.0.iter().find(|(known, _)| *known == handle);
        found
            .map(|(_, module)| Arc::clone(module))
            .ok_or(Error::StaleHandle { kind: ShaderModuleHandle::KIND, name: None })
    }
}

/// A [`ComputePipelineDesc`] that owns its parts.
pub(crate) struct OwnedComputeDesc {
    plain: ComputePipelineDesc<'static>,
    specialization: Vec<SpecializationConstant>,
    layouts: Vec<BlockLayout>,
    name: String,
}

impl OwnedComputeDesc {
    pub(crate) fn new(desc: &ComputePipelineDesc<'_>) -> Self {
        Self {
            plain: compute_desc(desc, &[], &[], ""),
            specialization: desc.specialization.to_vec(),
            layouts: desc.layouts.to_vec(),
            name: desc.debug_name.to_owned(),
        }
    }

    pub(crate) fn desc(&self) -> ComputePipelineDesc<'_> {
        compute_desc(&self.plain, &self.specialization, &self.layouts, &self.name)
    }
}

fn compute_desc<'a>(
    plain: &ComputePipelineDesc<'_>,
    specialization: &'a [SpecializationConstant],
    layouts: &'a [BlockLayout],
    debug_name: &'a str,
) -> ComputePipelineDesc<'a> {
    ComputePipelineDesc {
        module: plain.module,
        specialization,
        required_subgroup_size: plain.required_subgroup_size,
        full_subgroups: plain.full_subgroups,
        layouts,
        debug_name,
    }
}

/// A [`RenderPipelineDesc`] that owns its parts.
pub(crate) struct OwnedRenderDesc {
    plain: RenderPipelineDesc<'static>,
    bindings: Vec<VertexBinding>,
    attributes: Vec<VertexAttribute>,
    color: Vec<ColorTarget>,
    specialization: Vec<SpecializationConstant>,
    layouts: Vec<BlockLayout>,
    name: String,
}

/// The lists of a [`RenderPipelineDesc`].
#[derive(Default)]
struct RenderLists<'a> {
    bindings: &'a [VertexBinding],
    attributes: &'a [VertexAttribute],
    color: &'a [ColorTarget],
    specialization: &'a [SpecializationConstant],
    layouts: &'a [BlockLayout],
    name: &'a str,
}

impl OwnedRenderDesc {
    pub(crate) fn new(desc: &RenderPipelineDesc<'_>) -> Self {
        Self {
            plain: render_desc(desc, RenderLists::default()),
            bindings: desc.vertex_bindings.to_vec(),
            attributes: desc.vertex_attributes.to_vec(),
            color: desc.color.to_vec(),
            specialization: desc.specialization.to_vec(),
            layouts: desc.layouts.to_vec(),
            name: desc.debug_name.to_owned(),
        }
    }

    pub(crate) fn desc(&self) -> RenderPipelineDesc<'_> {
        let Self { bindings, attributes, color, specialization, layouts, name, .. } = self;
        render_desc(&self.plain, RenderLists { bindings, attributes, color, specialization, layouts, name })
    }
}

fn render_desc<'a>(plain: &RenderPipelineDesc<'_>, lists: RenderLists<'a>) -> RenderPipelineDesc<'a> {
    RenderPipelineDesc {
        vertex: plain.vertex,
        task: plain.task,
        mesh: plain.mesh,
        tess_control: plain.tess_control,
        tess_eval: plain.tess_eval,
        geometry: plain.geometry,
        fragment: plain.fragment,
        topology: plain.topology,
        cull: plain.cull,
        front_face: plain.front_face,
        polygon: plain.polygon,
        line_width: plain.line_width,
        depth_bias: plain.depth_bias,
        depth_clamp: plain.depth_clamp,
        vertex_bindings: lists.bindings,
        vertex_attributes: lists.attributes,
        color: lists.color,
        depth: plain.depth,
        stencil: plain.stencil,
        samples: plain.samples,
        alpha_to_coverage: plain.alpha_to_coverage,
        sample_shading: plain.sample_shading,
        view_mask: plain.view_mask,
        shading_rate: plain.shading_rate,
        fast_link: plain.fast_link,
        specialization: lists.specialization,
        layouts: lists.layouts,
        debug_name: lists.name,
    }
}

/// A [`RayTracingPipelineDesc`] that owns its parts, without the libraries.
pub(crate) struct OwnedRayTracingDesc {
    ray_gen: Vec<ShaderModuleHandle>,
    miss: Vec<ShaderModuleHandle>,
    callable: Vec<ShaderModuleHandle>,
    hit_groups: Vec<HitGroup<'static>>,
    hit_records: Records,
    ray_gen_records: Records,
    miss_records: Records,
    callable_records: Records,
    plain: RayTracingPipelineDesc<'static>,
    specialization: Vec<SpecializationConstant>,
    layouts: Vec<BlockLayout>,
    name: String,
    pub(crate) modules: OwnedModules,
}

type Records = Vec<OwnedRecord>;

/// A [`ShaderRecord`] that owns its bytes.
struct OwnedRecord {
    bytes: Vec<u8>,
    layout: Option<StructLayout>,
}

impl OwnedRecord {
    fn new(record: &ShaderRecord<'_>) -> Self {
        Self { bytes: record.bytes().to_vec(), layout: record.layout() }
    }

    fn record(&self) -> ShaderRecord<'_> {
        ShaderRecord::with_layout(&self.bytes, self.layout)
    }
}

impl OwnedRayTracingDesc {
    pub(crate) fn new(desc: &RayTracingPipelineDesc<'_>, find: ModuleLookup<'_>) -> Result<Self> {
        let general = [desc.ray_gen, desc.miss, desc.callable].into_iter().flatten().copied();
        let of_group = |group: &HitGroup<'_>| [group.closest_hit, group.any_hit, group.intersection];
        let handles = general.chain(desc.hit_groups.iter().flat_map(of_group).flatten());
        Ok(Self::with_modules(desc, OwnedModules::find(handles, find)?))
    }

    fn with_modules(desc: &RayTracingPipelineDesc<'_>, modules: OwnedModules) -> Self {
        let records = |list: &[ShaderRecord<'_>]| list.iter().map(OwnedRecord::new).collect();
        let without_record = |group: &HitGroup<'_>| HitGroup {
            closest_hit: group.closest_hit,
            any_hit: group.any_hit,
            intersection: group.intersection,
            record: ShaderRecord::default(),
        };
        Self {
            modules,
            ray_gen: desc.ray_gen.to_vec(),
            miss: desc.miss.to_vec(),
            callable: desc.callable.to_vec(),
            hit_groups: desc.hit_groups.iter().map(without_record).collect(),
            hit_records: desc.hit_groups.iter().map(|group| OwnedRecord::new(&group.record)).collect(),
            ray_gen_records: records(desc.ray_gen_records),
            miss_records: records(desc.miss_records),
            callable_records: records(desc.callable_records),
            plain: RayTracingPipelineDesc {
                max_recursion: desc.max_recursion,
                max_callable_depth: desc.max_callable_depth,
                max_payload_bytes: desc.max_payload_bytes,
                max_hit_attribute_bytes: desc.max_hit_attribute_bytes,
                ..Default::default()
            },
            specialization: desc.specialization.to_vec(),
            layouts: desc.layouts.to_vec(),
            name: desc.debug_name.to_owned(),
        }
    }

    /// Calls `create` with the description.
    pub(crate) fn with_desc<R>(&self, create: impl FnOnce(&RayTracingPipelineDesc<'_>) -> R) -> R {
        let hit_groups: Vec<HitGroup<'_>> = std::iter::zip(&self.hit_groups, &self.hit_records)
            .map(|(group, record)| HitGroup { record: record.record(), ..*group })
            .collect();
        create(&RayTracingPipelineDesc {
            ray_gen: &self.ray_gen,
            miss: &self.miss,
            hit_groups: &hit_groups,
            callable: &self.callable,
            ray_gen_records: &borrowed(&self.ray_gen_records),
            miss_records: &borrowed(&self.miss_records),
            callable_records: &borrowed(&self.callable_records),
            specialization: &self.specialization,
            layouts: &self.layouts,
            debug_name: &self.name,
            ..self.plain
        })
    }
}

fn borrowed(records: &[OwnedRecord]) -> Vec<ShaderRecord<'_>> {
    records.iter().map(OwnedRecord::record).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Format, VertexFormat};
    use crate::handle::RayTracingLibraryHandle;
    use crate::pipeline::depth_stencil::{DepthTest, StencilTest};
    use crate::pipeline::rasterization::{CullMode, DepthBias, FrontFace, PolygonMode, Topology};
    use crate::pipeline::stage::SpecializationValue;
    use crate::resource::sampler::CompareOp;

    crate::shader_struct! {
        #[repr(C)]
        struct Push { image: u32 }
    }

    const CONSTANTS: &[SpecializationConstant] =
        &[SpecializationConstant { id: 3, value: SpecializationValue::F32(0.5) }];

    #[test]
    fn an_owned_description_of_a_graphics_pipeline_equals_the_callers() {
        let depth = DepthTest { format: Format::D32FloatS8, compare: CompareOp::Less, write: true };
        let module = |bits| Some(ShaderModuleHandle::from_bits(bits));
        let desc = RenderPipelineDesc {
            vertex: module(1),
            task: module(2),
            mesh: module(3),
            tess_control: module(4),
            tess_eval: module(5),
            geometry: module(6),
            fragment: module(7),
            topology: Topology::Patches { points: 3 },
            cull: CullMode::Back,
            front_face: FrontFace::Clockwise,
            polygon: PolygonMode::Line,
            line_width: 2.0,
            depth_bias: Some(DepthBias { constant: 1.0, ..Default::default() }),
            depth_clamp: true,
            vertex_bindings: &[VertexBinding { stride: 8, per_instance: true }],
            vertex_attributes: &[VertexAttribute { format: VertexFormat::F32x2, ..Default::default() }],
            color: &[ColorTarget::new(Format::Rgba8Unorm)],
            depth: Some(depth),
            stencil: Some(StencilTest::default()),
            samples: 4,
            alpha_to_coverage: true,
            sample_shading: 0.5,
            view_mask: 3,
            shading_rate: None,
            fast_link: true,
            specialization: CONSTANTS,
            layouts: &[BlockLayout::push_constants::<Push>()],
            debug_name: "everything",
        };
        assert_eq!(OwnedRenderDesc::new(&desc).desc(), desc);
    }

    #[test]
    fn an_owned_description_of_a_ray_tracing_pipeline_has_the_callers_lists() {
        let [first, second, third] = [1, 2, 3].map(ShaderModuleHandle::from_bits);
        let desc = RayTracingPipelineDesc {
            ray_gen: &[first],
            miss: &[second],
            hit_groups: &[HitGroup {
                any_hit: Some(third),
                record: ShaderRecord::from_bytes(&[7, 8]),
                ..Default::default()
            }],
            callable: &[third, first],
            ray_gen_records: &[ShaderRecord::from_bytes(&[1])],
            miss_records: &[ShaderRecord::from_bytes(&[2, 3])],
            callable_records: &[ShaderRecord::default(), ShaderRecord::from_bytes(&[4])],
            libraries: &[RayTracingLibraryHandle::from_bits(9)],
            max_recursion: 2,
            max_callable_depth: 3,
            max_payload_bytes: 4,
            max_hit_attribute_bytes: 5,
            specialization: CONSTANTS,
            layouts: &[BlockLayout::push_constants::<Push>()],
            debug_name: "rays",
        };
        let plain = RayTracingPipelineDesc { libraries: &[], ..desc };
        let lists = OwnedRayTracingDesc::with_modules(&desc, OwnedModules(Vec::new()));
        lists.with_desc(|owned| assert_eq!(format!("{owned:?}"), format!("{plain:?}")));
    }
}
