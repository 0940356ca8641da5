//! Bottom-level structures of the library's own, built by the CPU when they are created.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::Context;
use super::read_bounds::geometry_bytes;
use crate::accel::AccelStruct;
use crate::accel::desc::BlasDesc;
use crate::error::{Error, Result};
use crate::shared::Garbage;
use crate::software::blas_blob::{self, BlasBlob};
use crate::software::body::SoftwareBody;
use crate::software::mesh::Mesh;
use crate::software::quality::Quality;

impl Context {
    /// The structures of meshes, built on all cores; nothing where the device traces queries itself. Waits for the GPU
    /// to read the inputs back.
    pub(super) fn software_blobs(&self, descs: &[BlasDesc<'_>]) -> Result<Vec<Option<BlasBlob>>> {
        if !self.shared().gpu.caps.software_ray_query() {
            return Ok(descs.iter().map(|_| None).collect());
        }
        let all: Vec<_> = descs.iter().collect();
        let pieces = self.read_inputs(&all)?;
        let mesh = |desc: &BlasDesc<'_>| {
            let bytes = |geometry| (geometry_bytes(geometry, &pieces), geometry.flags());
            Mesh::new(&desc.geometries.iter().map(bytes).collect::<Vec<_>>())
        };
        on_all_cores(descs, |desc| blas_blob::build(&mesh(desc), Quality::of(desc.flags)))
    }

    /// Memory for a structure; it is filled before the next submission.
    pub(super) fn software_body(&self, name: &str, blob: &BlasBlob) -> Result<Arc<SoftwareBody>> {
        let (shared, bytes) = (self.shared(), blob.bytes.len() as u64);
        let body = SoftwareBody::new(&shared.gpu, &shared.accel_storage, name, bytes, Some(blob.bounds))?;
        Ok(Arc::new(body))
    }

    /// Copies what the CPU built.
    pub(super) fn fill_software(&self, target: &Arc<AccelStruct>, blob: &BlasBlob) -> Result<()> {
        let Some(body) = target.blas()?.software.as_ref() else { return Ok(()) };
        self.shared().retire(Garbage::Software(Arc::clone(body)));
        self.before_next_submission(|cmd| cmd.fill_software_blas(target, body, &blob.bytes))
    }
}

/// Each desc by whichever thread is free.
fn on_all_cores<T: Send>(
    descs: &[BlasDesc<'_>],
    build: impl Fn(&BlasDesc<'_>) -> T + Sync,
) -> Result<Vec<Option<T>>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut made = Vec::new();
        while let index = next.fetch_add(1, Ordering::Relaxed)
            && let Some(desc) = descs.get(index)
        {
            made.push((index, build(desc)));
        }
        made
    };
    let mut all: Vec<Option<T>> = descs.iter().map(|_| None).collect();
    let lost = |_| Error::usage("create_blas", "a thread that built a tree ended early");
    std::thread::scope(|scope| {
        let helpers: Vec<_> = (1..cores.min(descs.len())).map(|_| scope.spawn(work)).collect();
        let mut made = work();
        for helper in helpers {
            made.extend(helper.join().map_err(lost)?);
        }
        made.into_iter().for_each(|(index, built)| all[index] = Some(built));
        Ok(all)
    })
}
