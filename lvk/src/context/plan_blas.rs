//! Decides of what parts a bottom-level structure consists, and in which order their primitives are built.

use super::Context;
use crate::accel::blas::PartShape;
use crate::accel::build::BuildInput;
use crate::accel::desc::{BlasDesc, PrimitiveOrder};
use crate::accel::flags::{AccelStructSizes, BuildFlags};
use crate::accel::primitive_bounds::Bounds;
use crate::accel::primitive_map::{PrimitiveMap, table_words};
use crate::accel::reorder::{spatial_order, worth_ordering};
use crate::accel::split::{PartLimits, PartPlan, PartSizes, plan_split};
use crate::device_state::Shared;
use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::caps::limits::Limits;
use crate::software_ray_query::blas::most_sizes;

/// Meshes of fewer primitives are built as given: no order makes them slow.
const ORDERED_FROM: u64 = 64;

/// What becomes of a mesh.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Treatment {
    /// One part in the given order.
    AsGiven,
    /// One part, in a better order if there is one.
    Order,
    /// Several parts, each in a better order or not.
    Split { order: bool },
}

impl Context {
    /// Bytes a bottom-level structure would take in one piece (`vkGetAccelerationStructureBuildSizesKHR`, raised to
    /// what the context's [`DeviceProfile`](crate::DeviceProfile) says); at most, where only software traces it.
    pub fn blas_sizes(&self, desc: &BlasDesc<'_>) -> Result<AccelStructSizes> {
        let shared = self.shared();
        let input = input(shared, desc)?;
        if shared.gpu.accel.is_some() {
            return input.sizes(&shared.gpu);
        }
        most_sizes(desc.debug_name, desc.geometries, desc.flags)
    }

    /// The parts of every structure, with the tables of those that are cut or reordered.
    pub(super) fn blas_shapes(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Vec<PartShape>>> {
        let shared = self.shared();
        if shared.gpu.accel.is_none() {
            // Software has no parts; the descriptions are checked as for hardware.
            return descs.iter().map(|desc| input(shared, desc).map(|_| Vec::new())).collect();
        }
        let mut sizes = Vec::with_capacity(descs.len());
        let mut treatments = Vec::with_capacity(descs.len());
        for desc in descs {
            let whole = input(shared, desc)?.sizes(&shared.gpu)?;
            treatments.push(treatment(&shared.gpu, desc, &whole));
            sizes.push(whole);
        }
        let treated = |(_, treatment): &(&BlasDesc<'_>, &Treatment)| **treatment != Treatment::AsGiven;
        let read: Vec<_> = descs.iter().zip(&treatments).filter(treated).map(|(desc, _)| desc).collect();
        let mut bounds = self.read_bounds(&read)?.into_iter();
        let mut shapes = Vec::with_capacity(descs.len());
        for ((desc, sizes), treatment) in descs.iter().zip(sizes).zip(treatments) {
            let bounds = match treatment {
                Treatment::AsGiven => None,
                _ => bounds.next(),
            };
            shapes.push(self.shapes_of(desc, sizes, treatment, bounds.unwrap_or_default())?);
        }
        Ok(shapes)
    }

    fn shapes_of(
        &self,
        desc: &BlasDesc<'_>,
        whole: AccelStructSizes,
        treatment: Treatment,
        bounds: Vec<Vec<Bounds>>,
    ) -> Result<Vec<PartShape>> {
        let plans = match treatment {
            Treatment::AsGiven => Vec::new(),
            Treatment::Order => ordered_whole(&bounds).into_iter().collect(),
            Treatment::Split { order } => split(self.shared(), desc, &bounds, order)?,
        };
        if plans.is_empty() {
            let counts = desc.geometries.iter().map(|geometry| geometry.primitive_count()).collect();
            return Ok(vec![PartShape { counts, map: None, sizes: whole }]);
        }
        plans.into_iter().map(|plan| self.part_shape(desc, &plan)).collect()
    }

    /// A part with its tables, which are uploaded before the next submission.
    pub(super) fn part_shape(&self, desc: &BlasDesc<'_>, plan: &PartPlan) -> Result<PartShape> {
        let shared = self.shared();
        let boxes = desc.geometries.first().is_some_and(|geometry| geometry.is_boxes());
        let map = PrimitiveMap::new(&shared.gpu, desc.debug_name, &plan.geometries, boxes)?;
        let words = table_words(&plan.geometries);
        self.upload_object(&map.table, 0, bytemuck::cast_slice(&words))?;
        let counts: Vec<u32> = plan.geometries.iter().map(|list| list.len() as u32).collect();
        let mut input = input(shared, desc)?.gathered();
        input.set_counts(&counts);
        let sizes = input.sizes(&shared.gpu)?;
        Ok(PartShape { counts, map: Some(map), sizes })
    }
}

/// The checked input of the mesh as a whole. Addresses of matrices do not matter to size queries, but for being null.
pub(super) fn input(shared: &Shared, desc: &BlasDesc<'_>) -> Result<BuildInput> {
    const SOME_ADDRESS: u64 = 16;
    shared.gpu.check_acceleration_structures()?;
    desc.flags.check_blas(&shared.gpu, desc.debug_name)?;
    let find = |handle| shared.store.buffers.get(handle);
    let name = desc.debug_name;
    BuildInput::blas(&shared.gpu, name, desc.geometries, desc.flags, &find, Some(SOME_ADDRESS))
}

fn treatment(gpu: &Gpu, desc: &BlasDesc<'_>, whole: &AccelStructSizes) -> Treatment {
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
        false => Treatment::Split { order },
        true if order && primitives >= ORDERED_FROM => Treatment::Order,
        true => Treatment::AsGiven,
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

fn split(shared: &Shared, desc: &BlasDesc<'_>, bounds: &[Vec<Bounds>], order: bool) -> Result<Vec<PartPlan>> {
    let mut input = input(shared, desc)?.gathered();
    let mut sizes = |counts: &[u32]| {
        input.set_counts(counts);
        let sizes = input.sizes(&shared.gpu)?;
        let scratch_bytes = sizes.scratch_bytes();
        Ok(PartSizes { structure_bytes: sizes.structure_bytes, scratch_bytes })
    };
    let limits = part_limits(&shared.gpu.caps.limits);
    let mut plans = plan_split(desc.debug_name, bounds, &limits, &mut sizes)?;
    if order {
        plans.iter_mut().for_each(|plan| order_part(plan, bounds));
    }
    Ok(plans)
}

/// Puts the primitives of each geometry of a part into a better order.
fn order_part(plan: &mut PartPlan, bounds: &[Vec<Bounds>]) {
    for (numbers, bounds) in plan.geometries.iter_mut().zip(bounds) {
        let of_part: Vec<_> = numbers.iter().map(|number| bounds[*number as usize]).collect();
        let order = spatial_order(&of_part);
        if worth_ordering(&of_part, &order) {
            *numbers = order.iter().map(|place| numbers[*place as usize]).collect();
        }
    }
}

/// The whole mesh in a better order; none where the given one is good.
fn ordered_whole(bounds: &[Vec<Bounds>]) -> Option<PartPlan> {
    let given = |bounds: &Vec<Bounds>| (0..bounds.len() as u32).collect::<Vec<_>>();
    let mut plan = PartPlan { geometries: bounds.iter().map(given).collect() };
    order_part(&mut plan, bounds);
    let changed = plan.geometries.iter().any(|numbers| !numbers.is_sorted());
    changed.then_some(plan)
}
