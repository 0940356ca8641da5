//! Compaction: asked for, carried out once the GPU has said how small structures can be.

use std::sync::{Arc, PoisonError};

use ash::vk;

use super::Context;
use crate::accel::AccelStruct;
use crate::accel::blas::{Blas, BlasBody};
use crate::accel::compaction::SizeQuery;
use crate::accel::flags::BuildFlags;
use crate::accel::raw_structure::RawStructure;
use crate::error::{Error, Result};
use crate::handle::AccelStructHandle;
use crate::resource::QueryPool;
use crate::resource::query::QueryPoolDesc;
use crate::shared::Garbage;

impl Context {
    /// Asks for bottom-level structures to be copied into as little memory as they need. Nothing waits.
    ///
    /// The sizes are asked of the GPU before the next submission; at a later submission, or frame, that finds the
    /// answers there, the copies are made and the structures' handles stand for them. Top-level structures that refer
    /// to a copied one are written and built again before that submission. The old memory is freed when the GPU is done
    /// with it. [`accel_struct_info`](Self::accel_struct_info) tells how far things are and what was saved. A compacted
    /// structure may be refitted, but not rebuilt. While a command buffer that builds a structure is not submitted yet,
    /// its copy waits: [`next_frame`](Self::next_frame) and [`flush`](Self::flush) are good moments.
    ///
    /// Structures that are compacted already, or about to be, are left alone.
    ///
    /// # Errors
    /// [`InvalidUsage`](Error::InvalidUsage) for a structure without [`BuildFlags::ALLOW_COMPACTION`], and then nothing
    /// is asked for.
    pub fn compact(&self, structures: &[AccelStructHandle]) -> Result<()> {
        let mut targets = Vec::with_capacity(structures.len());
        for handle in structures {
            let target = self.shared().store.accel_structs.get(*handle)?;
            if !target.flags.contains(BuildFlags::ALLOW_COMPACTION) {
                target.blas()?;
                let message = "compaction needs BuildFlags::ALLOW_COMPACTION when the structure is created";
                return Err(Error::usage(&target.name, message));
            }
            targets.push(target);
        }
        let mut wanted = Vec::with_capacity(targets.len());
        for target in targets {
            let blas = target.blas()?;
            if blas.body().compacted_from.is_none() && !blas.request_compaction(true) {
                wanted.push(target);
            }
        }
        self.ask_sizes(&wanted).inspect_err(|_| give_up(&wanted))
    }

    fn ask_sizes(&self, wanted: &[Arc<AccelStruct>]) -> Result<()> {
        if wanted.is_empty() {
            return Ok(());
        }
        let mut count = 0;
        let mut targets = Vec::with_capacity(wanted.len());
        for target in wanted {
            targets.push((Arc::clone(target), count));
            count += target.blas()?.parts.len() as u32;
        }
        let desc = QueryPoolDesc { count, debug_name: "compacted sizes" };
        let ty = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
        let pool = QueryPool::of(&self.shared().gpu, &desc, ty)?;
        let query = Arc::new(SizeQuery::new(pool, targets));
        let asked = self.before_next_submission(|cmd| cmd.query_compacted_sizes(&query));
        self.shared().retire(Garbage::SizeQuery(Arc::clone(&query)));
        asked?;
        self.compactions().push(query);
        Ok(())
    }

    /// Carries out compactions whose sizes are known, and builds top-level structures again that refer to what they
    /// replaced. What fails stays as it was, with a warning: no submission of the caller fails for it.
    pub(super) fn advance_compactions(&self) {
        let open = std::mem::take(&mut *self.compactions());
        for query in open {
            if let Err(error) = self.advance_compaction(&query) {
                log::warn!("structures stay uncompacted: {error}");
                query.targets.iter().for_each(|(target, _)| give_up(std::slice::from_ref(target)));
            }
        }
        if self.shared().take_outdated_tlas()
            && let Err(error) = self.rewrite_outdated()
        {
            log::warn!("a top-level structure still refers to structures from before compaction: {error}");
        }
    }

    fn advance_compaction(&self, query: &Arc<SizeQuery>) -> Result<()> {
        let Some(builds) = query.builds() else {
            self.compactions().push(Arc::clone(query));
            return Ok(());
        };
        let sizes = query.pool.values(0, query.pool.count)?;
        let Some(sizes) = sizes.into_iter().collect::<Option<Vec<_>>>() else {
            self.compactions().push(Arc::clone(query));
            return Ok(());
        };
        let (mut later, mut again) = (false, Vec::new());
        for ((target, first), builds) in query.targets.iter().zip(builds) {
            let blas = target.blas()?;
            if blas.body().compacted_from.is_some() {
                continue;
            }
            let sizes = &sizes[*first as usize..*first as usize + blas.parts.len()];
            if blas.builds() != builds {
                again.push(Arc::clone(target));
            } else if blas.has_open_builds() || !self.compact_one(target, blas, sizes, builds)? {
                later = true;
            }
        }
        if later {
            self.compactions().push(Arc::clone(query));
        }
        self.ask_sizes(&again)
    }

    /// Copies one structure, unless a build of it was recorded meanwhile.
    fn compact_one(
        &self,
        target: &Arc<AccelStruct>,
        blas: &Blas,
        sizes: &[u64],
        builds: u64,
    ) -> Result<bool> {
        let shared = self.shared();
        let ty = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        let structure =
            |bytes: &u64| RawStructure::new(&shared.gpu, &shared.accel_storage, &target.name, ty, *bytes);
        let structures = sizes.iter().map(structure).collect::<Result<Vec<_>>>()?;
        let compacted_from = Some(blas.body().memory_bytes());
        let body = BlasBody { structures, compacted_from, rebuildable: false };
        let replaced = self.before_next_submission(|cmd| {
            let Some(old) = blas.replace_body(body, builds) else { return Ok(None) };
            cmd.copy_compacted(target, &old, &blas.body())?;
            Ok(Some(old))
        })?;
        let Some(old) = replaced else { return Ok(false) };
        blas.request_compaction(false);
        shared.retire(Garbage::Body(old));
        // Its handle may be gone, and nobody else keep it until the copy is made.
        shared.retire(Garbage::Body(blas.body()));
        shared.note_outdated_tlas();
        Ok(true)
    }

    fn rewrite_outdated(&self) -> Result<()> {
        let outdated =
            |object: &Arc<AccelStruct>| object.tlas().is_ok_and(|tlas| tlas.contents().is_outdated());
        for object in self.shared().store.accel_structs.all().into_iter().filter(outdated) {
            self.before_next_submission(|cmd| cmd.rewrite_tlas(&object))?;
        }
        Ok(())
    }

    fn compactions(&self) -> std::sync::MutexGuard<'_, Vec<Arc<SizeQuery>>> {
        self.inner.compactions.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn give_up(targets: &[Arc<AccelStruct>]) {
    for blas in targets.iter().filter_map(|target| target.blas().ok()) {
        blas.request_compaction(false);
    }
}
