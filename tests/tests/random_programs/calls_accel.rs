//! Calls of the context on several acceleration structures at once, and questions about them.

use lvk::{AccelStructHandle, BlasDesc, BlasGeometry, BuildFlags, Queue, Triangles};

use super::calls::{MOST, Outcome};
use super::memory::{Blas, Effect};
use super::op::Kind;
use super::world::{BlasInfo, Object, Problem, World, judge};

impl World<'_> {
    /// Notes the problems of the call that is made.
    pub(super) fn note(&mut self, problems: &[Problem]) {
        self.tally.note(self.kind, problems);
        self.is_noted = true;
    }

    /// Creates up to three BLAS in a batch, before the next submission or on a queue. One that is wrong fails them all.
    pub(super) fn create_blas_batch(&mut self, n: [u16; 6]) -> Outcome {
        let count = usize::from(n[0] % 4);
        if self.blas.iter().filter(|blas| blas.holder.is_some()).count() + count > MOST / 2 {
            return Ok(false);
        }
        let picked: Option<Vec<_>> =
            (0..count).map(|at| self.pick_mesh(n[1].rotate_left(5 * at as u32))).collect();
        let Some(picked) = picked else { return Ok(false) };
        let mut problems: Vec<_> = picked.iter().filter_map(|mesh| mesh.problem).collect();
        let wrong = (n[2] % 16 == 15 && count > 0).then_some(usize::from(n[2] / 16) % count.max(1));
        problems.extend(wrong.map(|_| Problem::Usage));
        let is_updatable = |at: usize| n[3] >> at & 1 == 1;
        let can_compact = |at: usize| n[3] >> (4 + at) & 1 == 1;
        let geometries: Vec<_> = (0..)
            .zip(&picked)
            .map(|(at, mesh)| {
                let own = mesh.live.map_or(3, |number| 3 * self.meshes[number].info as u32);
                let vertices = if wrong == Some(at) { own + 3 } else { own };
                [BlasGeometry::Triangles(Triangles::packed(mesh.handle, vertices))]
            })
            .collect();
        let descs: Vec<_> = (0..)
            .zip(&geometries)
            .map(|(at, geometries)| {
                let mut flags =
                    if n[3] >> 8 & 1 == 1 { BuildFlags::FAST_BUILD } else { BuildFlags::FAST_TRACE };
                flags.set(BuildFlags::ALLOW_UPDATE, is_updatable(at));
                flags.set(BuildFlags::ALLOW_COMPACTION, can_compact(at));
                BlasDesc { geometries, flags, debug_name: "random BLAS", ..Default::default() }
            })
            .collect();
        let made = match n[4] % 8 {
            0..4 => self.ctx().create_blas_batch(&descs),
            kind => {
                let queue =
                    [Queue::Compute, Queue::Graphics, Queue::Compute, Queue::Transfer][usize::from(kind) - 4];
                problems.extend((queue == Queue::Transfer).then_some(Problem::WrongQueue));
                let made = self.ctx().create_blas_batch_on(queue, &descs);
                made.map(|(made, submission)| {
                    self.submitted.push(submission);
                    made
                })
            }
        };
        self.note(&problems);
        let Some(made) = judge(made, &problems)? else { return Ok(true) };
        if made.len() != count {
            return Err(format!("{} BLAS of a batch of {count}", made.len()));
        }
        for (at, (holder, mesh)) in made.into_iter().zip(&picked).enumerate() {
            let Some(mesh) = mesh.live else { continue };
            self.memory.blas.push(Blas { mesh, ..Default::default() });
            let effect = Effect::Build { blas: self.blas.len() };
            self.memory.apply(&self.env.expected(Kind::CreateBlasBatch, effect));
            let (is_updatable, can_compact) = (is_updatable(at), can_compact(at));
            let info = BlasInfo { mesh, is_updatable, can_compact, was_compacted: false };
            self.blas.push(Object::new(holder, info));
        }
        Ok(true)
    }

    /// Requests compaction of up to three structures, which may be one several times. One that is wrong fails them all.
    pub(super) fn compact_several(&mut self, n: [u16; 6]) -> Outcome {
        let (mut handles, mut numbers, mut problems) = (Vec::new(), Vec::new(), Vec::new());
        for at in 0..usize::from(n[0] % 4) {
            let Some(blas) = self.pick_blas(n[1 + at]) else { return Ok(false) };
            problems.extend(blas.problem);
            let can_compact = blas.live.is_none_or(|number| self.blas[number].info.can_compact);
            problems.extend((!can_compact).then_some(Problem::Usage));
            handles.push(blas.handle);
            numbers.extend(blas.live);
        }
        self.note(&problems);
        if judge(self.ctx().compact(&handles), &problems)?.is_some() {
            numbers.into_iter().for_each(|number| self.blas[number].info.was_compacted = true);
        }
        Ok(true)
    }

    /// Asks for sizes, progress and memory of a BLAS and a TLAS.
    pub(super) fn ask_accel(&mut self, n: [u16; 6]) -> Outcome {
        let (Some(blas), Some(tlas)) = (self.pick_blas(n[0]), self.pick_tlas(n[1])) else { return Ok(false) };
        for picked in [&blas, &tlas] {
            let problems: Vec<_> = picked.problem.into_iter().collect();
            let sizes = judge(self.ctx().accel_struct_sizes(picked.handle), &problems)?;
            if sizes.is_some_and(|sizes| sizes.structure_bytes == 0) {
                return Err("a structure takes no memory".to_owned());
            }
        }
        let problems: Vec<_> = [blas.problem, tlas.problem].into_iter().flatten().collect();
        let asked: [AccelStructHandle; 2] = [blas.handle, tlas.handle];
        if n[2].is_multiple_of(2) {
            judge(self.ctx().wait_idle(), &[])?;
        }
        self.note(&problems);
        if let Some(progress) = judge(self.ctx().build_progress(&asked), &problems)? {
            let is_known = n[2].is_multiple_of(2);
            if progress.total != 2 || progress.built > 2 || (is_known && progress.built != 2) {
                return Err(format!("{progress:?} of two structures that are built: {is_known}"));
            }
        }
        let Some(mesh) = self.pick_mesh(n[3]) else { return Ok(true) };
        let vertices = mesh.live.map_or(3, |number| 3 * self.meshes[number].info as u32);
        let geometries = [BlasGeometry::Triangles(Triangles::packed(mesh.handle, vertices))];
        let desc = BlasDesc { geometries: &geometries, ..Default::default() };
        let problems: Vec<_> = mesh.problem.into_iter().collect();
        let sizes = judge(self.ctx().blas_sizes(&desc), &problems)?;
        let memory = self.ctx().accel_memory();
        let live = self.blas.iter().filter(|blas| blas.holder.is_some()).count();
        let of_blas = memory.structures.iter().filter(|found| found.name == "random BLAS").count();
        if sizes.is_some_and(|sizes| sizes.structure_bytes == 0) || of_blas < live {
            return Err(format!("{of_blas} BLAS, of which {live} are those of the program; {sizes:?}"));
        }
        Ok(true)
    }
}
