//! Runs a program against the library and the model.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use lvk::{Destroy, Queue};
use lvk_tests::accel_backend::builds_software_bvhs;
use lvk_tests::random::Random;

use super::cell::compare;
use super::environment::Environment;
use super::op::{Kind, Op};
use super::queries::OpenQueries;
use super::world::{Object, Open, Problem, Tally, World, judge, pick};

/// Most command buffers that are recorded at once.
const MOST_OPEN: usize = 4;
/// Submissions that are remembered.
const MOST_SUBMITTED: usize = 8;

/// Failure of a program.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Number of the operation; the number of operations for what is found after the last.
    pub at: usize,
    /// The difference between library and model.
    pub message: String,
}

/// Runs a program. Returns what it has done.
///
/// # Errors
/// The first difference from the model, a panic, or a message of the validation layer.
pub fn run(env: &Environment, ops: &[Op]) -> Result<Tally, Failure> {
    let mut at = 0;
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        let mut world = World::new(env).map_err(|error| error.to_string())?;
        for op in ops {
            if world.step(op).map_err(|message| format!("{op:?}: {message}"))? {
                world.tally.executed += 1;
                if !world.has_recorded_problems {
                    world.record_problems(&[]);
                }
            }
            at += 1;
        }
        world.finish()
    }));
    let outcome = outcome.unwrap_or_else(|panic| Err(format!("panic: {}", panic_text(&*panic))));
    outcome.map_err(|message| Failure { at, message })
}

fn panic_text(panic: &dyn std::any::Any) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned())).unwrap_or_default()
}

impl World<'_> {
    /// Runs an operation. Returns false if it had no objects to work on.
    fn step(&mut self, op: &Op) -> Result<bool, String> {
        let n = op.n;
        (self.kind, self.has_recorded_problems) = (op.kind, false);
        match op.kind {
            Kind::CreateBuffer => self.create_buffer(n),
            Kind::DestroyBuffer => self.destroy_buffer(n),
            Kind::UploadBuffer => self.upload_buffer(n),
            Kind::DownloadBuffer => self.download_buffer(n, false),
            Kind::ReadBufferLater => self.download_buffer(n, true),
            Kind::BufferAddress => self.buffer_address(n),
            Kind::CreateTexture => self.create_texture(n),
            Kind::CreateView => self.create_view(n),
            Kind::DestroyTexture => self.destroy_texture(n),
            Kind::UploadTexture => self.upload_texture(n),
            Kind::DownloadTexture => self.download_texture(n, false),
            Kind::ReadTextureLater => self.download_texture(n, true),
            Kind::FinishReadback => self.finish_readback(n),
            Kind::CreateSampler => self.create_sampler(),
            Kind::DestroySampler => Ok(self.samplers.pop().is_some()),
            Kind::CreateMesh => self.create_mesh(n),
            Kind::UploadMesh => self.upload_mesh(n),
            Kind::DestroyMesh => self.destroy_mesh(n),
            Kind::CreateBlas => self.create_blas(n),
            Kind::DestroyBlas => self.destroy_blas(n),
            Kind::CreateTlas => self.create_tlas(n),
            Kind::DestroyTlas => self.destroy_tlas(n),
            Kind::CreateRays => self.create_rays(n),
            Kind::DestroyRays => self.destroy_rays(n),
            Kind::Compact => self.compact(n),
            Kind::AccelInfo => self.accel_info(n),
            Kind::Acquire => self.acquire(n),
            Kind::Submit => self.submit(n),
            Kind::DropCommands => self.drop_commands(n),
            Kind::RecordOnThreads => self.record_on_threads(n, Op::random_recorded),
            Kind::RecordAnyOnThreads => self.record_on_threads(n, Op::random_recorded_of_any_kind),
            Kind::MapBuffer => self.map_buffer(n),
            Kind::CreateBlasBatch => self.create_blas_batch(n),
            Kind::CompactSeveral => self.compact_several(n),
            Kind::ReloadBlas => self.reload_blas(n),
            Kind::AskAccel => self.ask_accel(n),
            Kind::AskContext => self.ask_context(n),
            Kind::AskRaw => self.ask_raw(n),
            Kind::CreateNearestSampler => self.create_nearest_sampler(n),
            Kind::CreateCube => self.create_solid(n, false),
            Kind::CreateVolume => self.create_solid(n, true),
            Kind::ReadQueries => self.read_queries(n),
            Kind::UploadShared => self.upload_shared(n),
            Kind::DownloadShared => self.download_shared(n),
            Kind::ReplaceShared => self.replace_shared(),
            Kind::Wait => self.wait(n),
            Kind::IsDone => self.is_done(n),
            Kind::WaitIdle => self.wait_idle(),
            Kind::Flush => judge(self.ctx().flush(), &[]).map(|_| true),
            Kind::NextFrame => judge(self.ctx().next_frame(), &[]).map(|_| true),
            _ => self.record_one(op),
        }
    }

    fn record_one(&mut self, op: &Op) -> Result<bool, String> {
        if self.open.is_empty() {
            self.open_commands(Queue::Graphics)?;
        }
        let at = usize::from(op.n[0] ^ op.n[1]) % self.open.len();
        let Some(planned) = self.plan(op, at) else { return Ok(false) };
        self.record(at, planned)?;
        Ok(false)
    }

    fn open_commands(&mut self, queue: Queue) -> Result<(), String> {
        let mut cmd = self.ctx().acquire_command_buffer_on(queue).map_err(|error| error.to_string())?;
        cmd.set_debug_name("random commands");
        if cmd.queue() != queue {
            return Err(format!("the command buffer is for {:?}, not for {queue:?}", cmd.queue()));
        }
        self.open.push(Open {
            cmd,
            queue,
            effects: Vec::new(),
            tlas: HashMap::new(),
            blas: HashMap::new(),
            queries: OpenQueries::default(),
            builds_shared: false,
        });
        Ok(())
    }

    fn acquire(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if self.open.len() >= MOST_OPEN {
            return Ok(false);
        }
        let queue = match n[0] % 6 {
            0 | 1 => Queue::Compute,
            2 => Queue::Transfer,
            _ => Queue::Graphics,
        };
        self.open_commands(queue)?;
        Ok(true)
    }

    fn submit(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if n[1] % 64 == 63 {
            let foreign = self.env.foreign.command_buffer().map_err(|error| error.to_string())?;
            judge(self.ctx().submit(foreign), &[Problem::Usage])?;
            return Ok(true);
        }
        if self.open.is_empty() {
            return Ok(false);
        }
        let open = self.open.swap_remove(usize::from(n[0]) % self.open.len());
        let mut problems = Vec::new();
        for (tlas, updates) in &open.tlas {
            if updates.expected.is_some_and(|count| self.tlas[*tlas].info.count != count) {
                problems.push(Problem::Usage);
            }
        }
        problems.extend(open.queries.problem(&self.memory.queries));
        let is_overtaken = self.is_overtaken(&open);
        let sent = match n[1] % 4 {
            0 => self.ctx().submit_in_background(open.cmd),
            _ => self.ctx().submit(open.cmd),
        };
        if is_overtaken && matches!(sent, Err(lvk::Error::InvalidUsage { .. })) {
            return Ok(true);
        }
        if let Some(handle) = judge(sent, &problems)? {
            open.effects.iter().for_each(|effect| self.memory.apply(effect));
            for (tlas, updates) in open.tlas {
                self.tlas[tlas].info.count = updates.count;
            }
            self.submitted.push(handle);
            if self.submitted.len() > MOST_SUBMITTED {
                self.submitted.remove(0);
            }
        }
        Ok(true)
    }

    /// True if the submission may be refused: software traces, and a BLAS of the commands was built since they were
    /// recorded, or may be built by another thread. It depends on the builder of the BLAS.
    fn is_overtaken(&self, open: &Open) -> bool {
        let is_newer = |(blas, version): (&usize, &u32)| self.memory.blas[*blas].version != *version;
        builds_software_bvhs(self.ctx()) && (open.builds_shared || open.blas.iter().any(is_newer))
    }

    fn drop_commands(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if self.open.is_empty() {
            return Ok(false);
        }
        drop(self.open.swap_remove(usize::from(n[0]) % self.open.len()));
        Ok(true)
    }

    /// Records several commands into each open command buffer, each on a thread of its own.
    fn record_on_threads(&mut self, n: [u16; 6], random_op: fn(&mut Random) -> Op) -> Result<bool, String> {
        while self.open.len() < 2 {
            self.open_commands(Queue::Graphics)?;
        }
        let mut random = Random::new(u64::from(n[0]) << 16 | u64::from(n[1]));
        let mut plans: Vec<Vec<_>> = Vec::new();
        for at in 0..self.open.len() {
            let ops: Vec<Op> = (0..2 + n[2] % 8).map(|_| random_op(&mut random)).collect();
            plans.push(ops.iter().filter_map(|op| self.plan(op, at)).collect());
        }
        let planned = || plans.iter().flatten();
        planned().for_each(|planned| self.tally.record_problems(planned.kind, &planned.problems));
        self.tally.executed += planned().count() as u64;
        self.tally.refused += planned().filter(|planned| !planned.problems.is_empty()).count() as u64;
        let env = self.env;
        let outcomes: Vec<Result<(), String>> = std::thread::scope(|scope| {
            let threads = self.open.iter_mut().zip(plans).map(|(open, plans)| {
                scope.spawn(move || {
                    for planned in plans {
                        if let Some(effects) = planned.run(env, &mut open.cmd)? {
                            open.effects.extend(effects);
                        }
                    }
                    Ok(())
                })
            });
            let threads: Vec<_> = threads.collect();
            let join = |thread: std::thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| Err(format!("panic: {}", panic_text(&*panic))))
            };
            threads.into_iter().map(join).collect()
        });
        outcomes.into_iter().collect::<Result<Vec<()>, _>>()?;
        Ok(true)
    }

    fn wait(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if n[1] % 32 == 31 {
            judge(self.ctx().wait(self.env.foreign.submission), &[Problem::Usage])?;
            return Ok(true);
        }
        if self.submitted.is_empty() {
            return Ok(false);
        }
        let handle = self.submitted[usize::from(n[0]) % self.submitted.len()];
        judge(self.ctx().wait(handle), &[])?;
        self.expect_done(handle)
    }

    fn is_done(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if n[1] % 32 == 31 {
            judge(self.ctx().is_done(self.env.foreign.submission), &[Problem::Usage])?;
            return Ok(true);
        }
        if self.submitted.is_empty() {
            return Ok(false);
        }
        let handle = self.submitted[usize::from(n[0]) % self.submitted.len()];
        judge(self.ctx().is_done(handle), &[]).map(|_| true)
    }

    fn wait_idle(&mut self) -> Result<bool, String> {
        judge(self.ctx().wait_idle(), &[])?;
        for handle in self.submitted.clone() {
            self.expect_done(handle)?;
        }
        Ok(true)
    }

    fn expect_done(&self, handle: lvk::SubmitHandle) -> Result<bool, String> {
        match judge(self.ctx().is_done(handle), &[])? {
            Some(true) => Ok(true),
            _ => Err("a submission is not done after the wait for it".to_owned()),
        }
    }

    fn finish_readback(&mut self, n: [u16; 6]) -> Result<bool, String> {
        if self.pending.is_empty() {
            return Ok(false);
        }
        let pending = self.pending.swap_remove(usize::from(n[0]) % self.pending.len());
        if n[1] % 8 == 7 {
            return Ok(true);
        }
        if n[1].is_multiple_of(2) {
            judge(pending.readback.is_ready(), &[])?;
        }
        if let Some(bytes) = judge(pending.readback.wait(), &[])? {
            compare("bytes read later", &bytes, &pending.expected)?;
        }
        Ok(true)
    }

    fn destroy_buffer(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = self.pick_buffer(n[0]);
        Ok(destroy(self.env, &mut self.buffers, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    fn destroy_texture(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = self.pick_texture(n[0]);
        Ok(destroy(self.env, &mut self.textures, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    fn destroy_mesh(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = pick(&self.meshes, n[0], self.env.foreign.buffer());
        Ok(destroy(self.env, &mut self.meshes, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    fn destroy_blas(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = self.pick_blas(n[0]);
        Ok(destroy(self.env, &mut self.blas, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    fn destroy_tlas(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = self.pick_tlas(n[0]);
        Ok(destroy(self.env, &mut self.tlas, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    fn destroy_rays(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let picked = self.pick_rays(n[0]);
        Ok(destroy(self.env, &mut self.rays, picked.map(|found| (found.handle, found.live)), n[1]))
    }

    /// Compares all contents, and drops everything. Returns what the program has done.
    fn finish(mut self) -> Result<Tally, String> {
        while !self.pending.is_empty() {
            self.finish_readback([0, 1, 0, 0, 0, 0])?;
        }
        for (number, buffer) in self.buffers.iter().enumerate().filter(|(_, buffer)| buffer.holder.is_some())
        {
            let mut bytes = vec![0; buffer.info.size];
            judge(self.ctx().download_buffer(buffer.handle, 0, &mut bytes), &[])?;
            compare(&format!("buffer {number} at the end"), &bytes, &self.memory.buffers[number])?;
        }
        for (number, texture) in
            self.textures.iter().enumerate().filter(|(_, texture)| texture.holder.is_some())
        {
            for mip in 0..texture.info.part.mips {
                let region = lvk::TextureRegion { mip, layers: 0, ..Default::default() };
                let bytes =
                    judge(self.ctx().download_texture(texture.handle, &region), &[])?.unwrap_or_default();
                let place = texture.info.part.whole(mip);
                let expected = self.memory.images[place.image].read(&place);
                compare(&format!("mip {mip} of texture {number} at the end"), &bytes, &expected)?;
            }
        }
        self.compare_own_part()?;
        judge(self.ctx().set_profiling(false), &[])?;
        let (env, tally) = (self.env, Tally { hits: self.memory.hits, ..std::mem::take(&mut self.tally) });
        drop(self);
        env.check_messages()?;
        Ok(tally)
    }
}

/// Destroys an object by its holder or by its handle. A stale or foreign handle destroys nothing.
fn destroy<H: Destroy + Copy, T>(
    env: &Environment,
    objects: &mut [Object<H, T>],
    picked: Option<(H, Option<usize>)>,
    n: u16,
) -> bool {
    let Some((handle, live)) = picked else { return false };
    let holder = live.and_then(|number| objects[number].holder.take());
    match holder {
        Some(holder) if n.is_multiple_of(2) => drop(holder),
        Some(holder) => env.ctx().destroy(holder.release()),
        None => env.ctx().destroy(handle),
    }
    true
}
