//! Places the instances of a TLAS that the CPU builds.

use std::sync::Arc;

use rayon::prelude::*;

use super::software_storage;
use crate::accel::instance::{TlasInstance, check_instance};
use crate::device_state::SharedDeviceState;
use crate::error::Result;
use crate::handle::AccelStructHandle;
use crate::software_ray_query::blas::SoftwareBlas;
use crate::software_ray_query::bvh::build_threads::{TASK_LENGTH, on_build_threads};
use crate::software_ray_query::bvh::encode_instances::{InstancedBlas, PlacedInstance, place_instance};

/// Returns the instances of a TLAS that rays can hit; `None` if the CPU does not know all of their bounds.
pub(super) fn place_instances(
    shared: &SharedDeviceState,
    tlas: &str,
    instances: &[TlasInstance],
) -> Result<Option<Vec<PlacedInstance>>> {
    if instances.len() <= TASK_LENGTH {
        return place_some(shared, tlas, 0, instances);
    }
    let tasks = instances.par_chunks(TASK_LENGTH).enumerate();
    let place = |(task, some)| place_some(shared, tlas, task * TASK_LENGTH, some);
    let parts: Vec<_> = on_build_threads(|| tasks.map(place).collect());
    let mut placed = Vec::with_capacity(instances.len());
    for part in parts {
        match part? {
            Some(part) => placed.extend(part),
            None => return Ok(None),
        }
    }
    Ok(Some(placed))
}

/// Places some of the instances, from the one numbered `first`.
fn place_some(
    shared: &SharedDeviceState,
    tlas: &str,
    first: usize,
    instances: &[TlasInstance],
) -> Result<Option<Vec<PlacedInstance>>> {
    let mut placed = Vec::with_capacity(instances.len());
    let mut last: Option<(AccelStructHandle, InstancedBlas)> = None;
    for (number, instance) in (first..).zip(instances) {
        check_instance(tlas, number, instance)?;
        let shown = match last {
            Some((handle, shown)) if handle == instance.blas => shown,
            _ => match instanced_blas(shared, instance.blas)? {
                Some(shown) => shown,
                None => return Ok(None),
            },
        };
        placed.extend(place_instance(number as u32, instance, &shown));
        last = Some((instance.blas, shown));
    }
    Ok(Some(placed))
}

fn instanced_blas(shared: &SharedDeviceState, handle: AccelStructHandle) -> Result<Option<InstancedBlas>> {
    let blas = shared.store.accel_structs.get(handle)?;
    let address = software_storage(&blas.name, blas.blas()?)?.address;
    let parts = blas.blas()?.software.as_ref().and_then(SoftwareBlas::rebraid_parts);
    Ok(parts.map(|parts| InstancedBlas { address, parts: Arc::clone(parts) }))
}
