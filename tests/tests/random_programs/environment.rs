//! A context, the pipelines of the programs, and another context whose handles are foreign.

use std::sync::atomic::{AtomicUsize, Ordering};

use lvk::test_hooks::with_unordered_queues;
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, CommandBuffer, Context,
    Holder, QueryPoolDesc, QueryPoolHandle, QueueRequest, RayTracingPipelineHandle, SubmitHandle,
    TextureDesc, TextureHandle, Triangles, ValidationSink,
};
use lvk_tests::device_with;

use super::kit::{Kit, ray_pipeline};
use super::memory::Effect;
use super::op::Kind;
use super::shared::Shared;

/// The queues of a context.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Queues {
    /// The device's own.
    Own,
    /// Three on one Vulkan queue.
    Emulated,
    /// As emulated ones, but late and in a random order: what a submission does not wait for may run after it.
    Unordered,
}

/// All kinds of queues.
pub const QUEUES: [Queues; 3] = [Queues::Own, Queues::Emulated, Queues::Unordered];

/// Objects of another context.
pub struct Foreign {
    ctx: Context,
    buffer: Holder<BufferHandle>,
    texture: Holder<TextureHandle>,
    blas: Holder<AccelStructHandle>,
    rays: Option<Holder<RayTracingPipelineHandle>>,
    queries: Holder<QueryPoolHandle>,
    /// A submission.
    pub submission: SubmitHandle,
}

impl Foreign {
    fn new(ctx: Context) -> lvk::Result<Self> {
        let corners = [[0.0_f32, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
        let buffer = ctx.create_buffer(&BufferDesc {
            data: Some(bytemuck::cast_slice(&corners)),
            usage: BufferUsage::ACCEL_INPUT,
            ..Default::default()
        })?;
        let geometries = [BlasGeometry::Triangles(Triangles::packed(*buffer, 3))];
        let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, ..Default::default() })?;
        let texture = ctx.create_texture(&TextureDesc::default())?;
        let rays = ctx.capabilities().ray_tracing_pipeline.then(|| ray_pipeline(&ctx)).transpose()?;
        let queries = ctx.create_query_pool(&QueryPoolDesc::default())?;
        let submission = ctx.flush()?;
        Ok(Self { ctx, buffer, texture, blas, rays, queries, submission })
    }

    /// Returns a buffer.
    pub fn buffer(&self) -> BufferHandle {
        *self.buffer
    }

    /// Returns a texture.
    pub fn texture(&self) -> TextureHandle {
        *self.texture
    }

    /// Returns a BLAS.
    pub fn blas(&self) -> AccelStructHandle {
        *self.blas
    }

    /// Returns a ray tracing pipeline, if the device has any.
    pub fn rays(&self) -> Option<RayTracingPipelineHandle> {
        self.rays.as_deref().copied()
    }

    /// Returns a pool of queries.
    pub fn queries(&self) -> QueryPoolHandle {
        *self.queries
    }

    /// Returns a command buffer.
    pub fn command_buffer(&self) -> lvk::Result<CommandBuffer> {
        self.ctx.acquire_command_buffer()
    }
}

/// Everything that programs share. Declared before the context, the pipelines and foreign objects go first.
pub struct Environment {
    /// Pipelines.
    pub kit: Kit,
    /// Objects that programs on several threads use at once.
    pub shared: Shared,
    /// Objects of another context.
    pub foreign: Foreign,
    ctx: Context,
    sinks: [ValidationSink; 2],
    /// Bytes of acceleration structures before any program.
    own_bytes: u64,
    /// A pool of queries that was destroyed.
    pub stale_queries: QueryPoolHandle,
    /// Operations about which the model is wrong on purpose, and the number of threads from which on it is.
    pub wrong_about: Option<(Kind, usize)>,
    /// Number of threads of the program that runs.
    threads: AtomicUsize,
}

impl Environment {
    /// Creates both contexts. `None` as for [`lvk_tests::device`].
    pub fn new(queues: Queues) -> Option<Self> {
        Self::with_seed(queues, 1)
    }

    /// As [`new`](Self::new), with a seed for the order of unordered queues.
    pub fn with_seed(queues: Queues, seed: u64) -> Option<Self> {
        let make = |queues| device_with(|desc| desc.queues = queues);
        let made = match queues {
            Queues::Own => make(QueueRequest::OwnHardware),
            Queues::Emulated => make(QueueRequest::Emulated),
            Queues::Unordered => with_unordered_queues(seed, || make(QueueRequest::Emulated)),
        };
        let (ctx, sink) = made?.into_context();
        let (other, other_sink) = device_with(|_| {})?.into_context();
        let (ctx, other) = (ctx?, other?);
        let kit = Kit::new(&ctx);
        let foreign = Foreign::new(other);
        let (Ok(kit), Ok(foreign), Ok(shared)) = (kit, foreign, Shared::new(&ctx)) else {
            unreachable!("the set-up of the programs fails")
        };
        let own_bytes = ctx.accel_memory().structure_bytes;
        let stale_queries = ctx.create_query_pool(&QueryPoolDesc::default()).ok()?.handle();
        Some(Self {
            own_bytes,
            stale_queries,
            kit,
            shared,
            foreign,
            ctx,
            sinks: [sink, other_sink],
            wrong_about: None,
            threads: AtomicUsize::new(1),
        })
    }

    /// Returns the context.
    pub fn ctx(&self) -> &Context {
        &self.ctx
    }

    /// Sets the number of threads of the program that is run next.
    pub fn set_threads(&self, threads: usize) {
        self.threads.store(threads, Ordering::Relaxed);
    }

    /// Returns the effect that the model expects of an operation, which may be wrong on purpose.
    pub fn expected(&self, kind: Kind, effect: Effect) -> Effect {
        match self.wrong_about {
            Some((about, threads)) if about == kind && self.threads.load(Ordering::Relaxed) >= threads => {
                Effect::Wrong(Box::new(effect))
            }
            _ => effect,
        }
    }

    /// Fails if the validation layer sent a message since the last call.
    pub fn check_messages(&self) -> Result<(), String> {
        let messages: Vec<String> =
            self.sinks.iter().flat_map(ValidationSink::take).map(|message| message.to_string()).collect();
        if messages.is_empty() {
            Ok(())
        } else {
            Err(format!("the validation layer says: {}", messages.join("\n")))
        }
    }

    /// Fails if an object of a program is alive, or if the GPU uses memory of acceleration structures.
    pub fn check_all_gone(&self) -> Result<(), String> {
        self.ctx.wait_idle().map_err(|error| error.to_string())?;
        let live = self.ctx.live_objects();
        if live.len() != self.kit.object_count() + Shared::COUNT {
            return Err(format!("objects are alive after the program: {live:?}"));
        }
        let bytes = self.ctx.accel_memory().structure_bytes;
        if bytes != self.own_bytes {
            let before = self.own_bytes;
            return Err(format!(
                "acceleration structures take {bytes} bytes after the program, {before} before"
            ));
        }
        Ok(())
    }
}
