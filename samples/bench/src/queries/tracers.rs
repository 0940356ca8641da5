//! The tracers under test: driver pipelines, driver ray queries and software ray queries, with their scenes.

use std::rc::Rc;

use lvk::{AccelStructHandle, BlasDesc, BuildFlags, Context, Holder, PrimitiveOrder, TlasDesc, TlasInstance};

use super::contexts::Contexts;
use super::mesh_chunks::split_into_chunks;
use crate::error::BenchError;
use crate::measure::Stopwatch;
use crate::mesh::{Mesh, MeshBuffers};
use crate::tracer::MeshTracer;
use lvk_samples::hybrid::RayPath;

/// Layout of the traced scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Layout {
    /// One instance of the whole mesh.
    SingleInstance,
    /// One instance per chunk of the mesh.
    Chunks,
}

/// Implementation of ray tracing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Backend {
    /// The driver's ray tracing pipeline.
    Pipeline,
    /// The driver's ray queries.
    Query,
    /// The library's software ray queries.
    Software,
}

/// One tracer under test with its scene.
pub(super) struct TracerCase {
    pub(super) name: String,
    pub(super) layout: Layout,
    pub(super) backend: Backend,
    pub(super) ctx: Context,
    pub(super) scene: Rc<BuiltScene>,
    pub(super) tracer: Rc<MeshTracer>,
    pub(super) stopwatch: Rc<Stopwatch>,
}

/// All tracers under test, sorted by layout and backend; the given triangle order before the spatial one.
pub(super) struct TracerCases {
    pub(super) all: Vec<TracerCase>,
    pub(super) chunk_count: usize,
}

impl TracerCases {
    /// Creates all tracers that the device supports.
    pub(super) fn new(contexts: &Contexts, mesh: &Mesh, chunk_count: u32) -> Result<Self, BenchError> {
        use Backend::{Pipeline, Query, Software};
        use PrimitiveOrder::{Given, Spatial};
        let both = ContextTracers::new(&contexts.both, &[Pipeline, Software])?;
        let chunks = split_into_chunks(mesh, chunk_count);
        let mut all = Vec::new();
        for (layout, meshes) in
            [(Layout::SingleInstance, std::slice::from_ref(mesh)), (Layout::Chunks, &chunks[..])]
        {
            both.add(
                &mut all,
                layout,
                meshes,
                BlasSettings(BuildFlags::FAST_TRACE, Given),
                &[Pipeline, Software],
            )?;
            both.add(&mut all, layout, meshes, BlasSettings(BuildFlags::FAST_TRACE, Spatial), &[Pipeline])?;
        }
        let whole = std::slice::from_ref(mesh);
        for flags in [BuildFlags::LOW_MEMORY, BuildFlags::FAST_BUILD] {
            both.add(&mut all, Layout::SingleInstance, whole, BlasSettings(flags, Given), &[Software])?;
        }
        if let Some(ctx) = contexts.driver_with_queries() {
            let driver = ContextTracers::new(ctx, &[Query])?;
            for order in [Given, Spatial] {
                driver.add(
                    &mut all,
                    Layout::SingleInstance,
                    whole,
                    BlasSettings(BuildFlags::FAST_TRACE, order),
                    &[Query],
                )?;
            }
        }
        all.sort_by_key(|case| (case.layout, case.backend));
        Ok(Self { all, chunk_count: chunks.len() })
    }
}

/// Build flags and triangle order of a BLAS.
#[derive(Clone, Copy)]
struct BlasSettings(BuildFlags, PrimitiveOrder);

impl BlasSettings {
    fn name(self, backend: Backend) -> String {
        let order = if self.1 == PrimitiveOrder::Spatial { "spatial order" } else { "given order" };
        let quality = match self.0 {
            BuildFlags::LOW_MEMORY => "low memory",
            BuildFlags::FAST_BUILD => "fast build",
            _ => "fast trace",
        };
        match backend {
            Backend::Pipeline => format!("pipeline, {order}"),
            Backend::Query => format!("driver query, {order}"),
            Backend::Software => format!("software, {quality}"),
        }
    }
}

/// The tracers and the stopwatch of one context.
struct ContextTracers {
    ctx: Context,
    tracers: Vec<(Backend, Rc<MeshTracer>)>,
    stopwatch: Rc<Stopwatch>,
}

impl ContextTracers {
    /// Creates tracers for those of `backends` that the context supports.
    fn new(ctx: &Context, backends: &[Backend]) -> Result<Self, BenchError> {
        let has_pipelines = ctx.capabilities().ray_tracing_pipeline;
        let mut tracers = Vec::new();
        for backend in backends.iter().filter(|backend| has_pipelines || **backend != Backend::Pipeline) {
            let path = if *backend == Backend::Pipeline { RayPath::Pipeline } else { RayPath::Query };
            tracers.push((*backend, Rc::new(MeshTracer::new(ctx, path)?)));
        }
        Ok(Self { ctx: ctx.clone(), tracers, stopwatch: Rc::new(Stopwatch::new(ctx)?) })
    }

    /// Builds the scene and adds a case for each of `backends` that the context supports.
    fn add(
        &self,
        cases: &mut Vec<TracerCase>,
        layout: Layout,
        meshes: &[Mesh],
        build: BlasSettings,
        backends: &[Backend],
    ) -> Result<(), BenchError> {
        let tracers: Vec<_> = self.tracers.iter().filter(|(backend, _)| backends.contains(backend)).collect();
        if tracers.is_empty() {
            return Ok(());
        }
        let scene = Rc::new(BuiltScene::new(&self.ctx, meshes, build)?);
        cases.extend(tracers.into_iter().map(|(backend, tracer)| TracerCase {
            name: build.name(*backend),
            layout,
            backend: *backend,
            ctx: self.ctx.clone(),
            scene: Rc::clone(&scene),
            tracer: Rc::clone(tracer),
            stopwatch: Rc::clone(&self.stopwatch),
        }));
        Ok(())
    }
}

/// A built TLAS with one untransformed instance per mesh.
pub(super) struct BuiltScene {
    pub(super) tlas: Holder<AccelStructHandle>,
    _blas: Vec<Holder<AccelStructHandle>>,
    _buffers: Vec<MeshBuffers>,
}

impl BuiltScene {
    fn new(ctx: &Context, meshes: &[Mesh], BlasSettings(flags, order): BlasSettings) -> lvk::Result<Self> {
        let buffers =
            meshes.iter().map(|mesh| MeshBuffers::new(ctx, mesh)).collect::<lvk::Result<Vec<_>>>()?;
        let geometries: Vec<_> = buffers.iter().map(|buffers| [buffers.geometry()]).collect();
        let descs: Vec<_> = geometries
            .iter()
            .map(|geometries| BlasDesc {
                geometries,
                flags,
                order,
                debug_name: "mesh",
                ..BlasDesc::default()
            })
            .collect();
        let blas = ctx.create_blas_batch(&descs)?;
        let instances: Vec<_> = blas.iter().map(|blas| TlasInstance::new(**blas)).collect();
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..TlasDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        Ok(Self { tlas, _blas: blas, _buffers: buffers })
    }
}
