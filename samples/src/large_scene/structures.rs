//! The acceleration structures of a world: from files where they were kept, else built, compacted, and kept.

use crate::app::sample_error::SampleError;
use std::ops::Range;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BuildFlags, Compaction, Context, Error, Holder, TlasDesc,
    TlasInstance, transform_rows,
};

use super::figures::{Origin, StructureFigures};
use super::structure_cache::{StructureCache, StructureKey};
use super::world::{Instance, World};
use crate::app::progress::Progress;
use crate::hybrid::SceneArrays;

/// Structures that are built together, and whose progress is then told: so many, of so many triangles, or a larger one alone.
const BATCH: usize = 8;
const BATCH_TRIANGLES: u64 = 1 << 19;
/// Rounds after which a compaction counts as not to be had.
const ROUNDS: u32 = 16;
/// Mask bits of instances (`kMaskSolid` in `shaders/rtx_pipeline/radiance.glsl`).
const MASK_SOLID: u8 = 1;
const MASK_GLASS: u8 = 2;

/// The acceleration structures of a world.
pub(super) struct Structures {
    pub(super) tlas: Holder<AccelStructHandle>,
    blas: Vec<Blas>,
}

struct Blas {
    holder: Holder<AccelStructHandle>,
    origin: Origin,
    built_bytes: u64,
}

/// Geometry of the acceleration structures.
pub(super) struct Plan<'a> {
    pub(super) ctx: &'a Context,
    pub(super) world: &'a World,
    pub(super) arrays: &'a SceneArrays,
    pub(super) cache: Option<StructureCache>,
    pub(super) compact: bool,
}

/// The result of loading the file of a piece.
enum LoadOutcome {
    Loaded(Holder<AccelStructHandle>),
    Nothing,
    Refused,
}

impl Structures {
    /// Loads, builds, compacts and keeps; `progress` counts pieces.
    pub(super) fn new(plan: &Plan<'_>, progress: &mut Progress) -> Result<Self, SampleError> {
        let geometries: Vec<_> = plan.world.pieces.iter().map(|piece| [plan.geometry(piece)]).collect();
        let descs: Vec<_> = geometries
            .iter()
            .zip(&plan.world.pieces)
            .map(|(geometries, piece)| plan.desc(geometries, &piece.name))
            .collect();
        let keys = plan.keys();
        progress.stage("loading acceleration structures", descs.len() as u64);
        let mut found = Vec::with_capacity(descs.len());
        for (index, desc) in descs.iter().enumerate() {
            progress.go_on()?;
            found.push(plan.load(desc, keys.get(index).copied())?);
            progress.set(index as u64 + 1);
        }
        let mut blas = plan.build_missing(&descs, found, progress)?;
        plan.compact(&mut blas, progress)?;
        plan.store_built(&blas, &keys, progress)?;
        Ok(Self { tlas: plan.top_level(&blas)?, blas })
    }

    /// Figures of each acceleration structure so far.
    pub(super) fn figures(&self, ctx: &Context, world: &World) -> lvk::Result<Vec<StructureFigures>> {
        let of_piece = |(blas, piece): (&Blas, &super::Piece)| {
            let info = ctx.accel_struct_info(*blas.holder)?;
            Ok(StructureFigures {
                name: piece.name.clone(),
                triangles: piece.triangles.len() as u64,
                parts: info.parts,
                built_bytes: blas.built_bytes,
                bytes: info.structure_bytes + info.table_bytes,
                origin: blas.origin,
            })
        };
        self.blas.iter().zip(&world.pieces).map(of_piece).collect()
    }
}

impl Plan<'_> {
    fn geometry(&self, piece: &super::Piece) -> BlasGeometry {
        self.arrays.geometry(&piece.triangles, piece.vertices.end)
    }

    fn desc<'a>(&self, geometries: &'a [BlasGeometry], name: &'a str) -> BlasDesc<'a> {
        BlasDesc { geometries, flags: self.flags(), debug_name: name, ..BlasDesc::default() }
    }

    fn flags(&self) -> BuildFlags {
        let compaction = if self.compact { BuildFlags::ALLOW_COMPACTION } else { BuildFlags::empty() };
        BuildFlags::FAST_TRACE | compaction
    }

    /// Returns the keys of the cache files; none without a cache.
    fn keys(&self) -> Vec<StructureKey> {
        let key = |piece| StructureKey::from_piece(self.world, piece, self.ctx.capabilities(), self.flags());
        self.cache.iter().flat_map(|_| self.world.pieces.iter().map(key)).collect()
    }

    /// The structure of an earlier start. Files that are of no use are dropped with a warning.
    fn load(&self, desc: &BlasDesc<'_>, key: Option<StructureKey>) -> lvk::Result<LoadOutcome> {
        let Some((cache, key)) = self.cache.as_ref().zip(key) else { return Ok(LoadOutcome::Nothing) };
        let Some(bytes) = cache.read(key) else { return Ok(LoadOutcome::Nothing) };
        // SAFETY: the folder is the program's own, whose files `keep` alone writes.
        match unsafe { self.ctx.load_blas(desc, &bytes) } {
            Ok(blas) => Ok(LoadOutcome::Loaded(blas)),
            Err(error) if is_of_file(&error) => {
                log::warn!("the structure '{}' is dropped: {error}", lvk::readable_name(cache.path(key)));
                Ok(LoadOutcome::Refused)
            }
            Err(error) => Err(error),
        }
    }

    /// Builds what was not found, some structures at a time.
    fn build_missing(
        &self,
        descs: &[BlasDesc<'_>],
        found: Vec<LoadOutcome>,
        progress: &mut Progress,
    ) -> Result<Vec<Blas>, SampleError> {
        let missing: Vec<_> =
            (0..found.len()).filter(|&i| !matches!(found[i], LoadOutcome::Loaded(_))).collect();
        let triangles: Vec<_> =
            missing.iter().map(|&index| self.world.pieces[index].triangles.len() as u64).collect();
        progress.stage("building acceleration structures", triangles.iter().sum());
        let (mut built, mut done) = (Vec::with_capacity(missing.len()), 0);
        for batch in batches(&triangles) {
            progress.go_on()?;
            let of_batch: Vec<_> = missing[batch.clone()].iter().map(|&index| descs[index]).collect();
            built.extend(self.ctx.create_blas_batch(&of_batch)?);
            self.ctx.wait_idle()?;
            done += triangles[batch].iter().sum::<u64>();
            progress.set(done);
        }
        let mut built = built.into_iter();
        let mut all = Vec::with_capacity(found.len());
        for found in found {
            let origin = match found {
                LoadOutcome::Loaded(_) => Origin::Loaded,
                LoadOutcome::Nothing => Origin::Built,
                LoadOutcome::Refused => Origin::Rebuilt,
            };
            let loaded = if let LoadOutcome::Loaded(blas) = found { Some(blas) } else { None };
            let Some(holder) = loaded.or_else(|| built.next()) else { break };
            let info = self.ctx.accel_struct_info(*holder)?;
            all.push(Blas { built_bytes: info.structure_bytes + info.table_bytes, holder, origin });
        }
        Ok(all)
    }

    /// Compacts what was built; what came from a file was compacted before.
    fn compact(&self, blas: &mut [Blas], progress: &mut Progress) -> Result<(), SampleError> {
        let built: Vec<_> =
            blas.iter().filter(|blas| blas.origin != Origin::Loaded).map(|blas| *blas.holder).collect();
        if !self.compact || built.is_empty() {
            return Ok(());
        }
        progress.stage("compacting acceleration structures", 0);
        self.ctx.compact(&built)?;
        for _ in 0..ROUNDS {
            progress.go_on()?;
            self.ctx.wait_idle()?;
            let mut pending = false;
            for handle in &built {
                pending |= self.ctx.accel_struct_info(*handle)?.compaction == Compaction::Pending;
            }
            if !pending {
                break;
            }
        }
        Ok(())
    }

    /// Keeps what was built for the next start.
    fn store_built(
        &self,
        blas: &[Blas],
        keys: &[StructureKey],
        progress: &mut Progress,
    ) -> Result<(), SampleError> {
        let Some(cache) = &self.cache else { return Ok(()) };
        let built: Vec<_> = blas.iter().zip(keys).filter(|(blas, _)| blas.origin != Origin::Loaded).collect();
        progress.stage("keeping acceleration structures", built.len() as u64);
        for (done, (blas, key)) in (1..).zip(built) {
            progress.go_on()?;
            match self.ctx.serialize_blas(*blas.holder) {
                Ok(bytes) => cache.store(*key, &bytes),
                Err(error) if is_of_file(&error) => {
                    log::warn!(
                        "the structure '{}' cannot be kept: {error}",
                        lvk::readable_name(cache.path(*key))
                    );
                }
                Err(error) => return Err(error.into()),
            }
            progress.set(done);
        }
        Ok(())
    }

    fn top_level(&self, blas: &[Blas]) -> lvk::Result<Holder<AccelStructHandle>> {
        let shown = |instance: &Instance| {
            let is_glass = self.world.pieces[instance.piece].is_refractive;
            TlasInstance {
                transform: transform_rows(&instance.place),
                custom_index: instance.piece as u32,
                mask: if is_glass { MASK_GLASS } else { MASK_SOLID },
                ..TlasInstance::new(*blas[instance.piece].holder)
            }
        };
        let instances: Vec<_> = self.world.instances.iter().map(shown).collect();
        self.ctx.create_tlas(&TlasDesc {
            instances: &instances,
            debug_name: "world tlas",
            ..TlasDesc::default()
        })
    }
}

/// True if only the next start is slower for it: what is in a file, or has no room beside the structure.
fn is_of_file(error: &Error) -> bool {
    use Error::{LimitExceeded, OutOfDeviceMemory, Serialized};
    matches!(error, Serialized { .. } | LimitExceeded { .. } | OutOfDeviceMemory { .. })
}

/// Structures of so many triangles each, cut into batches in their order.
fn batches(triangles: &[u64]) -> Vec<Range<usize>> {
    let (mut batches, mut start, mut sum) = (Vec::new(), 0, 0);
    for (index, count) in triangles.iter().enumerate() {
        if index > start && (index - start == BATCH || sum + count > BATCH_TRIANGLES) {
            batches.push(start..index);
            (start, sum) = (index, 0);
        }
        sum += count;
    }
    if start < triangles.len() {
        batches.push(start..triangles.len());
    }
    batches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_have_everything_once_and_no_more_than_they_may() {
        const LARGE: u64 = BATCH_TRIANGLES + 1;
        assert!(batches(&[]).is_empty());
        assert_eq!(batches(&[5, 6, 7]).first(), Some(&(0..3)));
        assert_eq!(batches(&[1; 17]), [0..8, 8..16, 16..17]);
        assert_eq!(batches(&[LARGE, 1, 1, LARGE, LARGE]), [0..1, 1..3, 3..4, 4..5]);
        assert_eq!(batches(&[BATCH_TRIANGLES / 2; 5]), [0..2, 2..4, 4..5]);
    }
}
