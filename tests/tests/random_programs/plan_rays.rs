//! Plans of commands that build acceleration structures and trace rays.

use lvk::{BuildMode, CommandBuffer, Dependencies, Queue, TlasInstance};

use super::environment::Environment;
use super::kit::{Kernel, Push};
use super::memory::{Effect, Instance, RAYS, SLOTS, Shading};
use super::plan::{Planned, Words, compute_problems};
use super::world::{OpenTlas, Problem, World};

/// Records all rays at the TLAS of an index, by the pipeline or by ray queries. They write words of a buffer.
pub(super) fn record_trace(
    env: &Environment,
    cmd: &mut CommandBuffer,
    to: &Words,
    index: u32,
    by_pipeline: bool,
) -> lvk::Result<()> {
    let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
    let push = Push { to: address, index, ..Default::default() };
    let writes = Dependencies { buffers: &[to.handle], ..Default::default() };
    match env.kit.trace().filter(|_| by_pipeline) {
        Some(pipeline) => {
            cmd.bind_ray_tracing_pipeline(pipeline)?;
            cmd.push_constants(&push)?;
            cmd.trace_rays([RAYS as u32, 1, 1], &writes)
        }
        None => {
            cmd.bind_compute_pipeline(env.kit.kernel(Kernel::Query))?;
            cmd.push_constants(&push)?;
            cmd.dispatch([RAYS as u32, 1, 1], &writes)
        }
    }
}

/// Returns the bytes of a triangle of a mesh.
pub fn triangle_bytes(triangle: usize, depth: u32) -> Vec<u8> {
    let (x, z) = (triangle as f32, depth as f32);
    bytemuck::cast_slice(&[[x, 0.0, z], [x + 1.0, 0.0, z], [x, 1.0, z]]).to_vec()
}

/// Returns the depth of a triangle.
pub fn triangle_depth(n: u16) -> u32 {
    1 + u32::from(n) % 40
}

/// Returns a mode: rebuild, refit, or either.
pub(super) fn mode(n: u16) -> BuildMode {
    match n % 3 {
        0 => BuildMode::Rebuild,
        1 => BuildMode::Refit,
        _ => BuildMode::Auto { max_refits: u32::from(u16::MAX) },
    }
}

impl World<'_> {
    pub(super) fn move_triangle(&self, n: [u16; 6]) -> Option<Planned> {
        let mesh = self.pick_mesh(n[0])?;
        let problems: Vec<_> = mesh.problem.into_iter().collect();
        let triangle = mesh.live.map_or(0, |number| usize::from(n[1]) % self.meshes[number].info);
        let depth = triangle_depth(n[2]);
        let effects = match mesh.live {
            Some(mesh) if problems.is_empty() => vec![Effect::Move { mesh, triangle, depth }],
            _ => Vec::new(),
        };
        let handle = mesh.handle;
        Some(Planned::new(problems, effects, move |_, cmd| {
            cmd.update_buffer(handle, 36 * triangle as u64, &triangle_bytes(triangle, depth))
        }))
    }

    pub(super) fn build_blas(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        let mut picked = vec![self.pick_blas(n[0])?];
        if n[1] % 2 == 1 {
            picked.push(self.pick_blas(n[2])?);
        }
        let mode = mode(n[3]);
        let mut problems = compute_problems(self.open[at].queue, [None]);
        for blas in &picked {
            problems.extend(blas.problem);
            let Some(number) = blas.live else { continue };
            let info = &self.blas[number].info;
            // Whether a compaction is done yet, and with it the outcome of a rebuild, depends on the time.
            if info.was_compacted && !(info.is_updatable() && mode != BuildMode::Rebuild) {
                return None;
            }
            if self.meshes[info.mesh].holder.is_none() {
                problems.push(Problem::Stale);
            }
            if mode == BuildMode::Refit && !info.is_updatable() {
                problems.push(Problem::Usage);
            }
        }
        if picked.len() == 2 && picked[0].live.is_some() && picked[0].live == picked[1].live {
            problems.push(Problem::Usage);
        }
        let mut handles: Vec<_> = picked.iter().map(|blas| blas.handle).collect();
        if n[4] % 32 == 31 {
            let tlas = self.pick_tlas(n[5])?;
            problems.push(tlas.problem.unwrap_or(Problem::Usage));
            handles.push(tlas.handle);
        }
        self.note_versions(at, picked.iter().filter_map(|blas| blas.live));
        let effects = if problems.is_empty() {
            picked.iter().filter_map(|blas| blas.live).map(|blas| Effect::Build { blas }).collect()
        } else {
            Vec::new()
        };
        Some(Planned::new(problems, effects, move |_, cmd| cmd.build_blas(&handles, mode)))
    }

    /// Notes the versions of BLAS that a command uses.
    pub(super) fn note_versions(&mut self, at: usize, used: impl Iterator<Item = usize>) {
        for blas in used {
            let version = self.memory.blas[blas].version;
            self.open[at].blas.entry(blas).or_insert(version);
        }
    }

    /// Returns up to `most` instances, those of the model, and the problems of their handles.
    pub(super) fn instances(
        &self,
        n: [u16; 3],
        most: usize,
    ) -> (Vec<TlasInstance>, Vec<Instance>, Vec<Problem>) {
        let (mut raw, mut known, mut problems) = (Vec::new(), Vec::new(), Vec::new());
        for slot in 0..usize::from(n[0]) % (most + 1) {
            let Some(blas) = self.pick_blas(n[1] >> slot) else { break };
            problems.extend(blas.problem);
            let depth = u32::from((n[2] >> (2 * slot)) % 30);
            let instance = Instance {
                blas: blas.live.unwrap_or(0),
                slot: slot as u32,
                depth,
                custom: u32::from((n[1] ^ n[2]) % 60) + slot as u32,
                is_visible: (n[2] >> slot) % 8 != 7,
            };
            let mut transform = [1.0, 0.0, 0.0, 4.0 * slot as f32, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
            transform[11] = depth as f32;
            raw.push(TlasInstance {
                transform,
                custom_index: instance.custom,
                mask: if instance.is_visible { 0xff } else { 0 },
                ..TlasInstance::new(blas.handle)
            });
            known.push(instance);
        }
        (raw, known, problems)
    }

    pub(super) fn update_tlas(&mut self, n: [u16; 6], at: usize) -> Option<Planned> {
        let tlas = self.pick_tlas(n[0])?;
        let mut problems = compute_problems(self.open[at].queue, [tlas.problem]);
        let (raw, known, others) = self.instances([n[1], n[2], n[3]], SLOTS);
        problems.extend(others);
        let mode = mode(n[4]);
        let count = raw.len() as u32;
        let effects = match tlas.live {
            Some(number) => self.place_instances(number, at, (known, count), mode, &mut problems),
            None => Vec::new(),
        };
        let handle = tlas.handle;
        Some(Planned::new(problems, effects, move |_, cmd| cmd.update_tlas(handle, &raw, mode)))
    }

    /// Returns the effect of an update of a TLAS with these instances and their number, and notes the update. Adds its
    /// problems; with any there is no effect.
    pub(super) fn place_instances(
        &mut self,
        tlas: usize,
        at: usize,
        (known, count): (Vec<Instance>, u32),
        mode: BuildMode,
        problems: &mut Vec<Problem>,
    ) -> Vec<Effect> {
        let info = self.tlas[tlas].info;
        if count > info.capacity {
            problems.push(Problem::Limit);
        }
        let before = self.open[at].tlas.get(&tlas).copied();
        let is_same = before.map_or(info.count, |open| open.count) == count;
        if mode == BuildMode::Refit && !(info.is_updatable && is_same) {
            problems.push(Problem::Usage);
        }
        if !problems.is_empty() {
            return Vec::new();
        }
        self.note_versions(at, known.iter().map(|instance| instance.blas));
        let refits = mode != BuildMode::Rebuild && info.is_updatable && is_same;
        let expected = match before {
            Some(open) => open.expected,
            None => refits.then_some(count),
        };
        self.open[at].tlas.insert(tlas, OpenTlas { count, expected });
        vec![Effect::Place { tlas, instances: known }]
    }

    pub(super) fn trace(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let tlas = self.pick_tlas(n[0])?.live?;
        let to = self.exact_words(n[1], n[2], RAYS)?;
        let problems = compute_problems(queue, [to.problem]);
        let effects = match to.number {
            Some(number) if problems.is_empty() => {
                vec![Effect::Trace { tlas, to: (number, to.offset), shading: Shading::default() }]
            }
            _ => Vec::new(),
        };
        let index = self.tlas[tlas].index;
        let by_pipeline = n[3] & 1 == 1;
        Some(Planned::new(problems, effects, move |env, cmd| record_trace(env, cmd, &to, index, by_pipeline)))
    }
}
