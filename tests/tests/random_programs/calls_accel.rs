//! Calls of the context on several acceleration structures at once, and questions about them.

use lvk::{AccelStructHandle, BlasDesc, BlasGeometry, BuildFlags, Holder, Queue, Triangles};

use super::calls::{MOST, Outcome};
use super::memory::{Blas, Effect};
use super::op::Kind;
use super::world::{BlasInfo, Object, Picked, Problem, World, judge};

/// Returns the flags of a BLAS of a batch.
fn batch_flags(n: u16, at: usize) -> BuildFlags {
    let mut flags = if n >> 8 & 1 == 1 { BuildFlags::FAST_BUILD } else { BuildFlags::FAST_TRACE };
    flags.set(BuildFlags::ALLOW_UPDATE, n >> at & 1 == 1);
    flags.set(BuildFlags::ALLOW_COMPACTION, n >> (4 + at) & 1 == 1);
    flags
}

impl World<'_> {
    /// Records the problems of the call that is made.
    pub(super) fn record_problems(&mut self, problems: &[Problem]) {
        self.tally.record_problems(self.kind, problems);
        self.has_recorded_problems = true;
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
        let geometry = |(at, mesh): (usize, &Picked<_>)| {
            let own = mesh.live.map_or(3, |number| 3 * self.meshes[number].info as u32);
            let vertices = if wrong == Some(at) { own + 3 } else { own };
            [BlasGeometry::Triangles(Triangles::packed(mesh.handle, vertices))]
        };
        let geometries: Vec<_> = picked.iter().enumerate().map(geometry).collect();
        let desc = |(at, geometries)| {
            let flags = batch_flags(n[3], at);
            BlasDesc { geometries, flags, debug_name: "random BLAS", ..Default::default() }
        };
        let descs: Vec<_> = (0..).zip(geometries.iter().map(|of| &of[..])).map(desc).collect();
        let queue = match n[4] % 8 {
            0..4 => None,
            4 | 5 => Some(Queue::Compute),
            6 => Some(Queue::Graphics),
            _ => Some(Queue::Transfer),
        };
        problems.extend((queue == Some(Queue::Transfer)).then_some(Problem::WrongQueue));
        self.record_problems(&problems);
        let Some(made) = judge(self.build_batch(queue, &descs), &problems)? else { return Ok(true) };
        if made.len() != count {
            return Err(format!("{} BLAS of a batch of {count}", made.len()));
        }
        for (at, (holder, mesh)) in
            made.into_iter().zip(picked.iter().filter_map(|mesh| mesh.live)).enumerate()
        {
            self.add_blas_of_batch(holder, mesh, batch_flags(n[3], at));
        }
        Ok(true)
    }

    /// Creates a batch, before the next submission or on a queue.
    fn build_batch(
        &mut self,
        queue: Option<Queue>,
        descs: &[BlasDesc<'_>],
    ) -> lvk::Result<Vec<Holder<AccelStructHandle>>> {
        let Some(queue) = queue else { return self.ctx().create_blas_batch(descs) };
        let (made, submission) = self.ctx().create_blas_batch_on(queue, descs)?;
        self.submitted.push(submission);
        Ok(made)
    }

    /// Adds a BLAS of a batch, which was built from its mesh.
    fn add_blas_of_batch(&mut self, holder: Holder<AccelStructHandle>, mesh: usize, flags: BuildFlags) {
        self.memory.blas.push(Blas { mesh, ..Default::default() });
        let effect = Effect::Build { blas: self.blas.len() };
        self.memory.apply(&self.env.expected(Kind::CreateBlasBatch, effect));
        self.blas.push(Object::new(holder, BlasInfo { mesh, flags, was_compacted: false }));
    }

    /// Serialises a BLAS, and loads the bytes as another one of the same mesh. Now and then the bytes are damaged, or the
    /// description has other flags.
    pub(super) fn reload_blas(&mut self, n: [u16; 6]) -> Outcome {
        let Some(blas) = self.pick_blas(n[0]) else { return Ok(false) };
        if self.blas.iter().filter(|blas| blas.holder.is_some()).count() >= MOST / 2 {
            return Ok(false);
        }
        let problems: Vec<_> = blas.problem.into_iter().collect();
        self.record_problems(&problems);
        let serialized = judge(self.ctx().serialize_blas(blas.handle), &problems)?;
        let (Some(mut bytes), Some(number)) = (serialized, blas.live) else { return Ok(true) };
        let mut info = self.blas[number].info;
        let mesh = &self.meshes[info.mesh];
        // Software ray queries get a BVH of what the mesh holds now.
        if self.memory.blas[number].depths != self.memory.meshes[info.mesh] {
            return Ok(false);
        }
        let mut problems: Vec<_> = mesh.holder.is_none().then_some(Problem::Stale).into_iter().collect();
        match n[1] % 8 {
            6 => info.flags.toggle(BuildFlags::ALLOW_UPDATE),
            7 => {
                let at = usize::from(n[2]) % bytes.len();
                bytes[at] ^= 1 << (n[3] % 8);
            }
            _ => {}
        }
        problems.extend((n[1] % 8 >= 6).then_some(Problem::Serialized));
        let geometries = [BlasGeometry::Triangles(Triangles::packed(mesh.handle, 3 * mesh.info as u32))];
        let desc = BlasDesc {
            geometries: &geometries,
            flags: info.flags,
            debug_name: "random BLAS",
            ..Default::default()
        };
        self.record_problems(&problems);
        // SAFETY: the bytes come from `serialize_blas`; a flipped bit is damage that the checksum detects.
        let loaded = unsafe { self.ctx().load_blas(&desc, &bytes) };
        if let Some(holder) = judge(loaded, &problems)? {
            // The mesh holds what the BLAS was built of, as above.
            self.memory.blas.push(Blas { mesh: info.mesh, ..Default::default() });
            let effect = Effect::Build { blas: self.blas.len() };
            self.memory.apply(&self.env.expected(Kind::ReloadBlas, effect));
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
            let can_compact = blas.live.is_none_or(|number| self.blas[number].info.can_compact());
            problems.extend((!can_compact).then_some(Problem::Usage));
            handles.push(blas.handle);
            numbers.extend(blas.live);
        }
        self.record_problems(&problems);
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
        self.record_problems(&problems);
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
