//! The objects of a program beside what the model knows of them, and the outcomes that calls must have.

use std::collections::{HashMap, HashSet};

use lvk::{
    AccelStructHandle, AddressMode, BufferHandle, BufferUsage, BuildFlags, CommandBuffer, Context, Destroy,
    Error, Format, Holder, MemoryKind, Queue, RayTracingPipelineHandle, Readback, SamplerHandle,
    SubmitHandle, TextureHandle, TextureUsage,
};

use super::cell::Cell;
use super::draw_items::INPUT_BYTES;
use super::environment::Environment;
use super::image::Part;
use super::memory::{Effect, Memory};
use super::op::Kind;
use super::plan::Planned;
use super::plan_pipelines::RaysInfo;
use super::plan_records::RECORD_BYTES;
use super::queries::{OpenQueries, QueryPools};
use super::shared::OwnPart;

/// Reason why a call must fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Problem {
    /// The object of a handle was destroyed.
    Stale,
    /// The object belongs to another context.
    Foreign,
    /// Arguments that are never valid.
    Usage,
    /// A count over a limit.
    Limit,
    /// The device cannot do this.
    Unsupported,
    /// The queue cannot do this.
    WrongQueue,
    /// A shader record does not fit its block.
    Record,
    /// Serialised bytes are damaged, or of another description.
    Serialized,
}

impl Problem {
    fn is(self, error: &Error) -> bool {
        match self {
            Self::Stale => matches!(error, Error::StaleHandle { .. }),
            Self::Foreign => matches!(error, Error::ForeignHandle { .. }),
            Self::Usage => matches!(error, Error::InvalidUsage { .. }),
            Self::Limit => matches!(error, Error::LimitExceeded { .. }),
            Self::Unsupported => matches!(error, Error::Unsupported { .. }),
            Self::WrongQueue => matches!(error, Error::WrongQueue { .. }),
            Self::Record => matches!(error, Error::ShaderRecord { .. }),
            Self::Serialized => matches!(error, Error::Serialized { .. }),
        }
    }
}

/// Compares the outcome of a call with the problems of its arguments: without any it must succeed, else fail with
/// the error of one of them. Returns the value of a success.
pub fn judge<T>(result: lvk::Result<T>, problems: &[Problem]) -> Result<Option<T>, String> {
    match result {
        Ok(value) if problems.is_empty() => Ok(Some(value)),
        Ok(_) => Err(format!("the call succeeded, expected an error of {problems:?}")),
        Err(error) => {
            let cause = match &error {
                Error::Creation { source, .. } => source,
                error => error,
            };
            if problems.iter().any(|problem| problem.is(cause)) {
                return Ok(None);
            }
            Err(format!("the call failed with '{error}', expected {problems:?}"))
        }
    }
}

/// An object: its holder while it is alive, and what the model knows of it.
pub struct Object<H: Destroy, T> {
    /// `None` once it is destroyed.
    pub holder: Option<Holder<H>>,
    /// Handle, also after its destruction.
    pub handle: H,
    /// Bindless index.
    pub index: u32,
    /// Contents and properties in the model.
    pub info: T,
}

impl<H: Destroy + Copy, T> Object<H, T> {
    /// Returns a live object.
    pub fn new(holder: Holder<H>, info: T) -> Self {
        Self { handle: holder.handle(), index: holder.index(), holder: Some(holder), info }
    }
}

/// A handle, its object if that is alive, else the problem.
#[derive(Debug, Clone, Copy)]
pub struct Picked<H> {
    /// The handle.
    pub handle: H,
    /// Number of the object, if it is alive.
    pub live: Option<usize>,
    /// Reason why calls refuse the handle.
    pub problem: Option<Problem>,
}

/// Chooses a handle: in one of 32 cases that of a destroyed object, in one `foreign`, else that of a live object.
/// `None` if there is none.
pub fn pick<H: Destroy + Copy, T>(objects: &[Object<H, T>], n: u16, foreign: H) -> Option<Picked<H>> {
    let choose = |is_alive: bool, n: usize| {
        let fits = |(_, object): &(usize, &Object<H, T>)| object.holder.is_some() == is_alive;
        let count = objects.iter().enumerate().filter(fits).count();
        objects
            .iter()
            .enumerate()
            .filter(fits)
            .nth(n % count.max(1))
            .map(|(number, object)| (number, object.handle))
    };
    let n = usize::from(n);
    match n % 32 {
        30 => {
            let stale = choose(false, n / 32);
            stale.map(|(_, handle)| Picked { handle, live: None, problem: Some(Problem::Stale) })
        }
        31 => Some(Picked { handle: foreign, live: None, problem: Some(Problem::Foreign) }),
        _ => choose(true, n / 32 + n % 32).map(|(number, handle)| Picked {
            handle,
            live: Some(number),
            problem: None,
        }),
    }
}

/// Properties of a buffer in the model. The number of the buffer is that of its bytes.
#[derive(Debug, Clone, Copy)]
pub struct BufferInfo {
    pub size: usize,
    pub memory: MemoryKind,
}

/// Properties of a texture or view in the model.
#[derive(Debug, Clone, Copy)]
pub struct TextureInfo {
    pub part: Part,
    pub format: Format,
    pub usage: TextureUsage,
    pub is_array: bool,
    pub is_cube: bool,
    /// True for volumes, whose slices are the layers of the model. They have one mip.
    pub is_volume: bool,
}

/// Properties of a BLAS in the model. The number of the BLAS is that of its contents.
#[derive(Debug, Clone, Copy)]
pub struct BlasInfo {
    pub mesh: usize,
    pub flags: BuildFlags,
    pub was_compacted: bool,
}

impl BlasInfo {
    pub fn is_updatable(&self) -> bool {
        self.flags.contains(BuildFlags::ALLOW_UPDATE)
    }

    pub fn can_compact(&self) -> bool {
        self.flags.contains(BuildFlags::ALLOW_COMPACTION)
    }
}

/// Properties of a TLAS in the model. The number of the TLAS is that of its contents.
#[derive(Debug, Clone, Copy)]
pub struct TlasInfo {
    pub capacity: u32,
    pub is_updatable: bool,
    /// Number of instances after the last submission.
    pub count: u32,
}

/// A command buffer that is being recorded.
pub struct Open {
    pub cmd: CommandBuffer,
    pub queue: Queue,
    /// Effects of its commands once it is submitted.
    pub effects: Vec<Effect>,
    /// Updates of TLAS by its commands.
    pub tlas: HashMap<usize, OpenTlas>,
    /// The BLAS that its commands build or reference, with their versions when the first was recorded.
    pub blas: HashMap<usize, u32>,
    /// Queries that its commands write.
    pub queries: OpenQueries,
    /// True if a command builds the BLAS that threads share.
    pub builds_shared: bool,
}

/// Updates of a TLAS in a command buffer.
#[derive(Debug, Clone, Copy)]
pub struct OpenTlas {
    /// Number of instances after the last one.
    pub count: u32,
    /// Number that must be submitted before, if the first is a refit.
    pub expected: Option<u32>,
}

/// Bytes that are read later, and those that the model expects.
pub struct Pending {
    pub readback: Readback,
    pub expected: Vec<Cell>,
}

/// Counts of executed and refused operations.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Tally {
    /// Operations that had objects to work on.
    pub executed: u64,
    /// Recorded commands among them that had to be refused.
    pub refused: u64,
    /// Rays that had to hit a triangle.
    pub hits: u64,
    /// Kinds of operations, each with the problems that their arguments had, and with none.
    pub seen: HashSet<(Kind, Option<Problem>)>,
}

impl Tally {
    /// Records the problems of an operation.
    pub fn record_problems(&mut self, kind: Kind, problems: &[Problem]) {
        self.seen.extend(problems.iter().map(|problem| (kind, Some(*problem))));
        if problems.is_empty() {
            self.seen.insert((kind, None));
        }
    }
}

impl std::ops::AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.executed += other.executed;
        self.refused += other.refused;
        self.hits += other.hits;
        self.seen.extend(other.seen);
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { executed, refused, hits, .. } = self;
        write!(out, "{executed} operations, {refused} of them refused commands, {hits} rays with hits")
    }
}

/// The state of a program.
pub struct World<'a> {
    pub env: &'a Environment,
    pub memory: Memory,
    pub buffers: Vec<Object<BufferHandle, BufferInfo>>,
    pub textures: Vec<Object<TextureHandle, TextureInfo>>,
    /// Samplers, those that take the nearest texel with their address mode.
    pub samplers: Vec<Object<SamplerHandle, Option<AddressMode>>>,
    pub meshes: Vec<Object<BufferHandle, usize>>,
    pub blas: Vec<Object<AccelStructHandle, BlasInfo>>,
    pub tlas: Vec<Object<AccelStructHandle, TlasInfo>>,
    pub rays: Vec<Object<RayTracingPipelineHandle, RaysInfo>>,
    pub open: Vec<Open>,
    pub submitted: Vec<SubmitHandle>,
    pub pending: Vec<Pending>,
    /// Arguments of indirect dispatches.
    pub arguments: Holder<BufferHandle>,
    /// Vertices, indices and arguments of draws: those that copies write, and those that dispatches write.
    pub draw_inputs: [Holder<BufferHandle>; 2],
    /// Number of draws.
    pub draw_number: Holder<BufferHandle>,
    /// Instances of TLAS.
    pub records: Holder<BufferHandle>,
    pub queries: QueryPools,
    /// Part of the objects that threads share, if there was one left.
    pub part: Option<OwnPart<'a>>,
    /// Counts so far.
    pub tally: Tally,
    /// Kind of the operation that runs.
    pub kind: Kind,
    /// True if its problems are recorded.
    pub has_recorded_problems: bool,
}

impl<'a> World<'a> {
    /// Returns the state in which a program begins.
    pub fn new(env: &'a Environment) -> lvk::Result<Self> {
        let own = |debug_name, size_bytes, usage| {
            let desc = lvk::BufferDesc { size_bytes, usage, debug_name, ..Default::default() };
            env.ctx().create_buffer(&desc)
        };
        let mut memory = Memory::default();
        let inputs = BufferUsage::VERTEX | BufferUsage::INDEX | BufferUsage::INDIRECT;
        Ok(Self {
            arguments: own("arguments", 16, BufferUsage::INDIRECT)?,
            draw_inputs: [own("copied", INPUT_BYTES, inputs)?, own("dispatched", INPUT_BYTES, inputs)?],
            draw_number: own("number of draws", 8, BufferUsage::INDIRECT)?,
            records: own("instances", RECORD_BYTES, BufferUsage::STORAGE)?,
            queries: QueryPools::new(env.ctx())?,
            part: env.shared.take_part(env.ctx(), &mut memory)?,
            env,
            memory,
            buffers: Vec::new(),
            textures: Vec::new(),
            samplers: Vec::new(),
            meshes: Vec::new(),
            blas: Vec::new(),
            tlas: Vec::new(),
            rays: Vec::new(),
            open: Vec::new(),
            submitted: Vec::new(),
            pending: Vec::new(),
            tally: Tally::default(),
            kind: Kind::Label,
            has_recorded_problems: false,
        })
    }

    /// Returns the context.
    pub fn ctx(&self) -> &'a Context {
        self.env.ctx()
    }

    /// Chooses a buffer.
    pub fn pick_buffer(&self, n: u16) -> Option<Picked<BufferHandle>> {
        pick(&self.buffers, n, self.env.foreign.buffer())
    }

    /// Chooses a texture or view.
    pub fn pick_texture(&self, n: u16) -> Option<Picked<TextureHandle>> {
        pick(&self.textures, n, self.env.foreign.texture())
    }

    /// Chooses the vertices of a mesh.
    pub fn pick_mesh(&self, n: u16) -> Option<Picked<BufferHandle>> {
        pick(&self.meshes, n, self.env.foreign.buffer())
    }

    /// Chooses a BLAS.
    pub fn pick_blas(&self, n: u16) -> Option<Picked<AccelStructHandle>> {
        pick(&self.blas, n, self.env.foreign.blas())
    }

    /// Chooses a TLAS.
    pub fn pick_tlas(&self, n: u16) -> Option<Picked<AccelStructHandle>> {
        pick(&self.tlas, n, self.env.foreign.blas())
    }

    /// Chooses a ray tracing pipeline.
    pub fn pick_rays(&self, n: u16) -> Option<Picked<RayTracingPipelineHandle>> {
        pick(&self.rays, n, self.env.foreign.rays()?)
    }

    /// Records a planned command into an open command buffer.
    pub fn record(&mut self, at: usize, planned: Planned) -> Result<(), String> {
        let (kind, problems) = (planned.kind, planned.problems.clone());
        let open = &mut self.open[at];
        let recorded = planned.run(self.env, &mut open.cmd)?;
        let is_gone = recorded.is_none() && problems.is_empty();
        self.tally.record_problems(kind, if is_gone { &[Problem::Stale] } else { &problems });
        match recorded {
            Some(effects) => open.effects.extend(effects),
            None => self.tally.refused += 1,
        }
        self.tally.executed += 1;
        Ok(())
    }
}

#[test]
fn outcomes_are_those_of_the_problems() {
    let stale = || Error::StaleHandle { kind: "buffer", name: None };
    assert_eq!(judge(Ok(3), &[]), Ok(Some(3)));
    assert!(judge(Ok(3), &[Problem::Usage]).is_err());
    assert_eq!(judge::<()>(Err(stale()), &[Problem::Usage, Problem::Stale]), Ok(None));
    assert!(judge::<()>(Err(stale()), &[]).unwrap_err().contains("stale buffer"));
    assert!(judge::<()>(Err(stale()), &[Problem::Foreign]).is_err());
}
