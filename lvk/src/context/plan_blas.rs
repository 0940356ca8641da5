//! Decides of what parts a bottom-level structure consists, and in which order their primitives are built.

use super::Context;
use crate::accel::blas::BlasPart;
use crate::accel::build::BuildInput;
use crate::accel::desc::{BlasDesc, PrimitiveOrder};
use crate::accel::flags::{AccelStructSizes, BuildFlags};
use crate::accel::primitive_bounds::Bounds;
use crate::accel::primitive_map::{PrimitiveMap, encode_table};
use crate::accel::reorder::{is_reorder_worthwhile, spatial_order};
use crate::accel::split::{PartLimits, PartPlan, PartSizes, plan_split};
use crate::device_state::DeviceState;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::software_ray_query::blas::max_sizes;

/// Meshes of fewer primitives are built as given: no order makes them slow.
const MIN_REORDERED_PRIMITIVES: u64 = 64;

/// What becomes of a mesh.
#[derive(Clone, Copy, PartialEq, Eq)]
enum BlasPlan {
    /// One part in the given order.
    Whole,
    /// One part, in a better order if there is one.
    Reordered,
    /// Several parts, each in a better order or not.
    Split { order: bool },
}

impl Context {
    /// Bytes a bottom-level structure would take in one piece (`vkGetAccelerationStructureBuildSizesKHR`, raised to
    /// what the context's [`DeviceProfile`](crate::DeviceProfile) says); at most, where only software traces it.
    pub fn blas_sizes(&self, desc: &BlasDesc<'_>) -> Result<AccelStructSizes> {
        let shared = self.device_state();
        let input = build_input(shared, desc)?;
        if shared.gpu.accel.is_some() {
            return input.query_sizes(&shared.gpu);
        }
        max_sizes(desc.debug_name, desc.geometries, desc.flags)
    }

    /// The parts of every structure, with the tables of those that are cut or reordered.
    pub(super) fn plan_blas_parts(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Vec<BlasPart>>> {
        let shared = self.device_state();
        if shared.gpu.accel.is_none() {
            // Software has no parts; the descriptions are checked as for hardware.
            return descs.iter().map(|desc| build_input(shared, desc).map(|_| Vec::new())).collect();
        }
        let mut sizes = Vec::with_capacity(descs.len());
        let mut treatments = Vec::with_capacity(descs.len());
        for desc in descs {
            let whole = build_input(shared, desc)?.query_sizes(&shared.gpu)?;
            treatments.push(choose_plan(&shared.gpu, desc, &whole));
            sizes.push(whole);
        }
        let treated = |(_, treatment): &(&BlasDesc<'_>, &BlasPlan)| **treatment != BlasPlan::Whole;
        let read: Vec<_> = descs.iter().zip(&treatments).filter(treated).map(|(desc, _)| desc).collect();
        let mut bounds = self.read_bounds(&read)?.into_iter();
        let mut shapes = Vec::with_capacity(descs.len());
        for ((desc, sizes), treatment) in descs.iter().zip(sizes).zip(treatments) {
            let bounds = match treatment {
                BlasPlan::Whole => None,
                _ => bounds.next(),
            };
            shapes.push(self.plan_parts_of_one(desc, sizes, treatment, bounds.unwrap_or_default())?);
        }
        Ok(shapes)
    }

    fn plan_parts_of_one(
        &self,
        desc: &BlasDesc<'_>,
        whole: AccelStructSizes,
        treatment: BlasPlan,
        bounds: Vec<Vec<Bounds>>,
    ) -> Result<Vec<BlasPart>> {
        let plans = match treatment {
            BlasPlan::Whole => Vec::new(),
            BlasPlan::Reordered => reordered_whole(&bounds).into_iter().collect(),
            BlasPlan::Split { order } => split_into_parts(self.device_state(), desc, &bounds, order)?,
        };
        if plans.is_empty() {
            let counts = desc.geometries.iter().map(|geometry| geometry.primitive_count()).collect();
            return Ok(vec![BlasPart { counts, map: None, sizes: whole }]);
        }
        plans.into_iter().map(|plan| self.new_part(desc, &plan)).collect()
    }

    /// A part with its tables, which are uploaded before the next submission.
    pub(super) fn new_part(&self, desc: &BlasDesc<'_>, plan: &PartPlan) -> Result<BlasPart> {
        let shared = self.device_state();
        let boxes = desc.geometries.first().is_some_and(|geometry| geometry.is_aabbs());
        let map = PrimitiveMap::new(&shared.gpu, desc.debug_name, &plan.geometries, boxes)?;
        let words = encode_table(&plan.geometries);
        self.upload_to_buffer(&map.table, 0, bytemuck::cast_slice(&words))?;
        let counts: Vec<u32> = plan.geometries.iter().map(|list| list.len() as u32).collect();
        let mut input = build_input(shared, desc)?.with_gathered_inputs();
        input.set_counts(&counts);
        let sizes = input.query_sizes(&shared.gpu)?;
        Ok(BlasPart { counts, map: Some(map), sizes })
    }
}

/// The checked input of the mesh as a whole. Addresses of matrices do not matter to size queries, but for being null.
pub(super) fn build_input(shared: &DeviceState, desc: &BlasDesc<'_>) -> Result<BuildInput> {
    const PLACEHOLDER_ADDRESS: u64 = 16;
    shared.gpu.check_acceleration_structures()?;
    desc.flags.check_blas(&shared.gpu, desc.debug_name)?;
    let find = |handle| shared.store.buffers.get(handle);
    let name = desc.debug_name;
    BuildInput::from_geometries(
        &shared.gpu,
        name,
        desc.geometries,
        desc.flags,
        &find,
        Some(PLACEHOLDER_ADDRESS),
    )
}

fn choose_plan(gpu: &Gpu, desc: &BlasDesc<'_>, whole: &AccelStructSizes) -> BlasPlan {
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
    match fits {
        false => BlasPlan::Split { order },
        true if order && primitives >= MIN_REORDERED_PRIMITIVES => BlasPlan::Reordered,
        true => BlasPlan::Whole,
    }
}

/// Scratch is given at an aligned address, which may take up to the alignment of what the limit allows.
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
    bounds: &[Vec<Bounds>],
    order: bool,
) -> Result<Vec<PartPlan>> {
    let mut input = build_input(shared, desc)?.with_gathered_inputs();
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

/// Puts the primitives of each geometry of a part into a better order.
fn reorder_part(plan: &mut PartPlan, bounds: &[Vec<Bounds>]) {
    for (numbers, bounds) in plan.geometries.iter_mut().zip(bounds) {
        let of_part: Vec<_> = numbers.iter().map(|number| bounds[*number as usize]).collect();
        let order = spatial_order(&of_part);
        if is_reorder_worthwhile(&of_part, &order) {
            *numbers = order.iter().map(|place| numbers[*place as usize]).collect();
        }
    }
}

/// The whole mesh in a better order; none where the given one is good.
fn reordered_whole(bounds: &[Vec<Bounds>]) -> Option<PartPlan> {
    let given = |bounds: &Vec<Bounds>| (0..bounds.len() as u32).collect::<Vec<_>>();
    let mut plan = PartPlan { geometries: bounds.iter().map(given).collect() };
    reorder_part(&mut plan, bounds);
    let changed = plan.geometries.iter().any(|numbers| !numbers.is_sorted());
    changed.then_some(plan)
}
