//! Planning of a BLAS: its split into parts, and the order of its primitives.

use std::sync::Arc;

use super::Context;
use super::readback::READBACK;
use crate::accel::AccelStruct;
use crate::accel::accel_struct::AccelKind;
use crate::accel::blas::{Blas, BlasPart, BlasStructures};
use crate::accel::build::{BuildInput, transform_matrices};
use crate::accel::desc::{BlasDesc, PrimitiveOrder};
use crate::accel::flags::{AccelStructSizes, BuildFlags};
use crate::accel::primitive_bounds::Bounds;
use crate::accel::primitive_map::{PrimitiveMap, encode_table};
use crate::accel::reorder::{is_reorder_worthwhile, spatial_order};
use crate::accel::split::{PartLimits, PartPlan, PartSizes, plan_split};
use crate::device_state::DeviceState;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::gpu::caps::optional_features::OptionalFeature;
use crate::gpu::memory::allocator::MemoryKind;
use crate::resource::Buffer;
use crate::resource::buffer::{BufferDesc, BufferUsage, InternalUsage};
use crate::software_ray_query::blas::{SoftwareBlas, max_sizes};

/// Meshes with fewer primitives are built in the given order, which is never slow for them.
const MIN_REORDERED_PRIMITIVES: u64 = 64;

/// The input of a BLAS: the transform matrices given by value, and the parts to build.
pub(crate) struct BlasInputs {
    pub(crate) transforms: Option<Buffer>,
    /// Empty if only software ray queries are used.
    pub(crate) parts: Vec<BlasPart>,
}

/// Treatment of a mesh.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BlasPlan {
    /// One part in the given order.
    Whole,
    /// One part, in a better order if there is one.
    Reordered,
    /// Several parts. `order` requests a better order for each.
    Split { order: bool },
}

impl Context {
    /// Returns the bytes that an unsplit BLAS would take (`vkGetAccelerationStructureBuildSizesKHR`, raised to the
    /// values of the context's [`DeviceProfile`](crate::DeviceProfile)). With software ray queries only, this is an
    /// upper bound.
    pub fn blas_sizes(&self, desc: &BlasDesc<'_>) -> Result<AccelStructSizes> {
        let shared = self.device_state();
        // Size queries only depend on the presence of a matrix address.
        const PLACEHOLDER_ADDRESS: u64 = 16;
        check_desc(shared, desc)?;
        let input = build_input(shared, desc, Some(PLACEHOLDER_ADDRESS))?;
        if shared.gpu.accel.is_some() {
            return input.query_sizes(&shared.gpu);
        }
        max_sizes(desc.debug_name, desc.geometries, desc.flags)
    }

    /// Converts the geometries of every BLAS and plans its parts, with the tables of those that are split or reordered.
    pub(super) fn plan_blas_inputs(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<BlasInputs>> {
        let shared = self.device_state();
        let converted =
            descs.iter().map(|desc| convert_geometries(shared, desc)).collect::<Result<Vec<_>>>()?;
        if shared.gpu.accel.is_none() {
            // Software BVHs have no parts. The descriptions are checked as for hardware.
            let checked = |(transforms, _)| BlasInputs { transforms, parts: Vec::new() };
            return Ok(converted.into_iter().map(checked).collect());
        }
        let mut plans = Vec::with_capacity(descs.len());
        for (desc, (_, input)) in descs.iter().zip(&converted) {
            let sizes = input.query_sizes(&shared.gpu)?;
            plans.push((choose_plan(&shared.gpu, desc, &sizes)?, sizes));
        }
        let is_read = |(_, (plan, _)): &(&BlasDesc<'_>, &(BlasPlan, _))| *plan != BlasPlan::Whole;
        let read: Vec<_> = descs.iter().zip(&plans).filter(is_read).map(|(desc, _)| desc).collect();
        let first = read.first().map_or("", |desc| desc.debug_name);
        let bounds = self.read_bounds(&read).map_err(|error| error.with_owner(READBACK, first))?;
        let mut bounds = bounds.into_iter();
        let mut inputs = Vec::with_capacity(descs.len());
        for ((desc, (transforms, input)), (plan, sizes)) in descs.iter().zip(converted).zip(plans) {
            let bounds = if plan == BlasPlan::Whole { None } else { bounds.next() }.unwrap_or_default();
            let plans = match plan {
                BlasPlan::Whole => Vec::new(),
                BlasPlan::Reordered => reordered_whole(&bounds).into_iter().collect(),
                BlasPlan::Split { order } => split_into_parts(shared, desc, &input, &bounds, order)?,
            };
            let parts = match plans.is_empty() {
                true => vec![BlasPart { input, map: None, sizes }],
                false => plans.iter().map(|plan| self.new_part(desc, &input, plan)).collect::<Result<_>>()?,
            };
            inputs.push(BlasInputs { transforms, parts });
        }
        Ok(inputs)
    }

    /// Creates a part of a mesh with the input `whole`. Its tables are uploaded before the next submission.
    pub(super) fn new_part(
        &self,
        desc: &BlasDesc<'_>,
        whole: &BuildInput,
        plan: &PartPlan,
    ) -> Result<BlasPart> {
        let shared = self.device_state();
        let boxes = desc.geometries.first().is_some_and(|geometry| geometry.is_aabbs());
        let map = PrimitiveMap::new(&shared.gpu, desc.debug_name, &plan.geometries, boxes)?;
        let words = encode_table(&plan.geometries);
        self.upload_to_buffer(&map.table, 0, bytemuck::cast_slice(&words))?;
        let counts: Vec<u32> = plan.geometries.iter().map(|list| list.len() as u32).collect();
        let input = whole.for_part(&map, &counts);
        let sizes = input.query_sizes(&shared.gpu)?;
        Ok(BlasPart { input, map: Some(map), sizes })
    }
}

/// Checks and converts the geometries of a BLAS, once for all of its size queries and builds. Creates the buffer of the
/// transform matrices given by value.
pub(crate) fn convert_geometries(
    shared: &DeviceState,
    desc: &BlasDesc<'_>,
) -> Result<(Option<Buffer>, BuildInput)> {
    check_desc(shared, desc)?;
    let matrices = transform_matrices(desc.geometries);
    let transforms =
        matrices.map(|matrices| new_transforms(shared, desc.debug_name, &matrices)).transpose()?;
    let input = build_input(shared, desc, transforms.as_ref().map(|buffer| buffer.address))?;
    Ok((transforms, input))
}

fn check_desc(shared: &DeviceState, desc: &BlasDesc<'_>) -> Result<()> {
    shared.gpu.check_acceleration_structures()?;
    desc.flags.check_blas(&shared.gpu, desc.debug_name)
}

/// Converts the whole mesh. `transforms` is the address of the transform matrices given by value.
fn build_input(shared: &DeviceState, desc: &BlasDesc<'_>, transforms: Option<u64>) -> Result<BuildInput> {
    let find = |handle| shared.store.buffers.get(handle);
    let BlasDesc { geometries, flags, debug_name, .. } = *desc;
    let mut input =
        BuildInput::from_geometries(&shared.gpu, debug_name, geometries, flags, &find, transforms)?;
    attach_opacity(shared, desc, &mut input)?;
    Ok(input)
}

fn new_transforms(shared: &DeviceState, name: &str, matrices: &[f32]) -> Result<Buffer> {
    let bytes: &[u8] = bytemuck::cast_slice(matrices);
    let desc = BufferDesc {
        size_bytes: bytes.len() as u64,
        usage: BufferUsage::ACCEL_INPUT,
        memory: MemoryKind::HostVisible,
        data: None,
        debug_name: name,
    };
    let buffer = Buffer::new(&shared.gpu, &desc, InternalUsage::NONE)?;
    buffer.write(0, bytes);
    Ok(buffer)
}
/// Makes the object behind the handle of a BLAS.
pub(crate) fn new_blas_object(
    desc: &BlasDesc<'_>,
    inputs: BlasInputs,
    body: BlasStructures,
    software: Option<SoftwareBlas>,
) -> AccelStruct {
    let BlasInputs { transforms, parts } = inputs;
    let hardware = parts.iter().map(|part| part.sizes);
    let all = hardware.chain(software.as_ref().map(|software| software.sizes(desc.flags)));
    let sizes = all.fold(AccelStructSizes::default(), AccelStructSizes::max_with);
    let blas = Blas::new(desc.geometries.to_vec(), transforms, parts, body, software);
    AccelStruct::new(desc.debug_name, desc.flags, sizes, AccelKind::Blas(Arc::new(blas)))
}

fn choose_plan(gpu: &Gpu, desc: &BlasDesc<'_>, whole: &AccelStructSizes) -> Result<BlasPlan> {
    let primitives: u64 = desc.geometries.iter().map(|geometry| u64::from(geometry.primitive_count())).sum();
    let order = match desc.order {
        PrimitiveOrder::Given => false,
        PrimitiveOrder::Spatial => true,
        PrimitiveOrder::Auto => gpu.caps.prefers_spatial_order && desc.flags.contains(BuildFlags::FAST_TRACE),
    };
    let limits = part_limits(&gpu.caps.limits);
    let fits = whole.structure_bytes <= limits.structure_bytes
        && whole.scratch_bytes() <= limits.scratch_bytes
        && primitives <= limits.primitives;
    if has_opacity(desc) {
        let what = || format!("opacity micromaps of BLAS '{}'", desc.debug_name);
        let too_large = || Error::unsupported(what(), "the mesh exceeds a limit of one structure; divide it");
        return fits.then_some(BlasPlan::Whole).ok_or_else(too_large);
    }
    Ok(match fits {
        false => BlasPlan::Split { order },
        true if order && primitives >= MIN_REORDERED_PRIMITIVES => BlasPlan::Reordered,
        true => BlasPlan::Whole,
    })
}

fn has_opacity(desc: &BlasDesc<'_>) -> bool {
    desc.opacity.iter().any(Option::is_some)
}

/// Gives triangles the opacity that the description names.
fn attach_opacity(shared: &DeviceState, desc: &BlasDesc<'_>, input: &mut BuildInput) -> Result<()> {
    if !has_opacity(desc) {
        return Ok(());
    }
    let what = format!("opacity micromaps of BLAS '{}'", desc.debug_name);
    shared.gpu.require(OptionalFeature::OpacityMicromaps, &what)?;
    if shared.gpu.caps.builds_software_structures() {
        return Err(Error::unsupported(what, "the traversal in software does not read them; leave them out"));
    }
    for (index, handle) in desc.opacity.iter().enumerate() {
        if let Some(handle) = handle {
            input.attach_opacity(desc.debug_name, index, &shared.store.micromaps.get(*handle)?)?;
        }
    }
    Ok(())
}

/// Returns the limits of one part. The scratch address is aligned, so up to `scratch_alignment` bytes of the allowed
/// scratch memory are lost.
pub(super) fn part_limits(limits: &Limits) -> PartLimits {
    PartLimits {
        structure_bytes: limits.max_accel_structure_bytes,
        scratch_bytes: limits.max_accel_scratch_bytes.saturating_sub(limits.scratch_alignment.into()),
        primitives: limits.max_blas_primitives,
    }
}

fn split_into_parts(
    shared: &DeviceState,
    desc: &BlasDesc<'_>,
    whole: &BuildInput,
    bounds: &[Vec<Bounds>],
    order: bool,
) -> Result<Vec<PartPlan>> {
    let mut input = whole.clone().with_gathered_inputs();
    let mut sizes = |counts: &[u32]| {
        input.set_counts(counts);
        let sizes = input.query_sizes(&shared.gpu)?;
        let scratch_bytes = sizes.scratch_bytes();
        Ok(PartSizes { structure_bytes: sizes.structure_bytes, scratch_bytes })
    };
    let limits = part_limits(&shared.gpu.caps.limits);
    let mut plans = plan_split(desc.debug_name, bounds, &limits, &mut sizes)?;
    if order {
        plans.iter_mut().for_each(|plan| reorder_part(plan, bounds));
    }
    Ok(plans)
}

/// Reorders the primitives of each geometry of a part if that is worthwhile.
fn reorder_part(plan: &mut PartPlan, bounds: &[Vec<Bounds>]) {
    for (numbers, bounds) in plan.geometries.iter_mut().zip(bounds) {
        let of_part: Vec<_> = numbers.iter().map(|number| bounds[*number as usize]).collect();
        let order = spatial_order(&of_part);
        if is_reorder_worthwhile(&of_part, &order) {
            *numbers = order.iter().map(|place| numbers[*place as usize]).collect();
        }
    }
}

/// Returns the whole mesh in a better order, or `None` if the given order is good.
fn reordered_whole(bounds: &[Vec<Bounds>]) -> Option<PartPlan> {
    let given = |bounds: &Vec<Bounds>| (0..bounds.len() as u32).collect::<Vec<_>>();
    let mut plan = PartPlan { geometries: bounds.iter().map(given).collect() };
    reorder_part(&mut plan, bounds);
    let changed = plan.geometries.iter().any(|numbers| !numbers.is_sorted());
    changed.then_some(plan)
}
