//! Who traces what.

use std::rc::Rc;

use lvk::{AccelStructHandle, BlasDesc, BuildFlags, Context, Holder, PrimitiveOrder, TlasDesc, TlasInstance};

use super::super::error::BenchError;
use super::super::measure::Stopwatch;
use super::super::mesh::{Mesh, MeshBuffers};
use super::super::tracer::Tracer;
use super::devices::Devices;
use super::pieces::pieces;
use lvk_samples::hybrid::RayPath;

/// What is traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Shape {
    /// One instance of the mesh.
    Whole,
    /// An instance for each piece.
    Cut,
}

/// By whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Walker {
    /// The driver's ray tracing pipeline.
    Pipeline,
    /// The driver's ray query.
    Query,
    /// The library.
    Software,
}

/// One way to trace the mesh.
pub(super) struct Side {
    pub(super) name: String,
    pub(super) shape: Shape,
    pub(super) walker: Walker,
    pub(super) ctx: Context,
    pub(super) scene: Rc<Scene>,
    pub(super) tracer: Rc<Tracer>,
    pub(super) stopwatch: Rc<Stopwatch>,
}

/// All ways, by shape and walker; the mesh's own order before the other.
pub(super) struct Sides {
    pub(super) all: Vec<Side>,
    pub(super) piece_count: usize,
}

/// All ways that there are on this device.
pub(super) fn sides(devices: &Devices, mesh: &Mesh, piece_count: u32) -> Result<Sides, BenchError> {
    use PrimitiveOrder::{Given, Spatial};
    use Walker::{Pipeline, Query, Software};
    let both = Tools::new(&devices.both, &[Pipeline, Software])?;
    let pieces = pieces(mesh, piece_count);
    let mut all = Vec::new();
    for (shape, meshes) in [(Shape::Whole, std::slice::from_ref(mesh)), (Shape::Cut, &pieces[..])] {
        both.add(&mut all, shape, meshes, Build(BuildFlags::FAST_TRACE, Given), &[Pipeline, Software])?;
        both.add(&mut all, shape, meshes, Build(BuildFlags::FAST_TRACE, Spatial), &[Pipeline])?;
    }
    let whole = std::slice::from_ref(mesh);
    for flags in [BuildFlags::LOW_MEMORY, BuildFlags::FAST_BUILD] {
        both.add(&mut all, Shape::Whole, whole, Build(flags, Given), &[Software])?;
    }
    if let Some(ctx) = devices.driver_with_queries() {
        let driver = Tools::new(ctx, &[Query])?;
        for order in [Given, Spatial] {
            driver.add(&mut all, Shape::Whole, whole, Build(BuildFlags::FAST_TRACE, order), &[Query])?;
        }
    }
    all.sort_by_key(|side| (side.shape, side.walker));
    Ok(Sides { all, piece_count: pieces.len() })
}

/// How structures are built.
#[derive(Clone, Copy)]
struct Build(BuildFlags, PrimitiveOrder);

impl Build {
    fn name(self, walker: Walker) -> String {
        let order = if self.1 == PrimitiveOrder::Spatial { "in spatial order" } else { "as given" };
        let tree = match self.0 {
            BuildFlags::LOW_MEMORY => "low memory",
            BuildFlags::FAST_BUILD => "fast build",
            _ => "fast trace",
        };
        match walker {
            Walker::Pipeline => format!("pipeline, {order}"),
            Walker::Query => format!("the driver's query, {order}"),
            Walker::Software => format!("software, {tree}"),
        }
    }
}

/// What all ways of one context share.
struct Tools {
    ctx: Context,
    tracers: Vec<(Walker, Rc<Tracer>)>,
    stopwatch: Rc<Stopwatch>,
}

impl Tools {
    /// For those of the walkers that the context has.
    fn new(ctx: &Context, walkers: &[Walker]) -> Result<Self, BenchError> {
        let has_pipelines = ctx.capabilities().ray_tracing_pipeline;
        let mut tracers = Vec::new();
        for walker in walkers.iter().filter(|walker| has_pipelines || **walker != Walker::Pipeline) {
            let path = if *walker == Walker::Pipeline { RayPath::Pipeline } else { RayPath::Query };
            tracers.push((*walker, Rc::new(Tracer::new(ctx, path)?)));
        }
        Ok(Self { ctx: ctx.clone(), tracers, stopwatch: Rc::new(Stopwatch::new(ctx)?) })
    }

    /// Adds what these walkers trace, if the context has any of them.
    fn add(
        &self,
        sides: &mut Vec<Side>,
        shape: Shape,
        meshes: &[Mesh],
        build: Build,
        walkers: &[Walker],
    ) -> Result<(), BenchError> {
        let tracers: Vec<_> = self.tracers.iter().filter(|(walker, _)| walkers.contains(walker)).collect();
        if tracers.is_empty() {
            return Ok(());
        }
        let scene = Rc::new(Scene::new(&self.ctx, meshes, build)?);
        sides.extend(tracers.into_iter().map(|(walker, tracer)| Side {
            name: build.name(*walker),
            shape,
            walker: *walker,
            ctx: self.ctx.clone(),
            scene: Rc::clone(&scene),
            tracer: Rc::clone(tracer),
            stopwatch: Rc::clone(&self.stopwatch),
        }));
        Ok(())
    }
}

/// One untransformed instance of each of some meshes, built.
pub(super) struct Scene {
    pub(super) tlas: Holder<AccelStructHandle>,
    _blas: Vec<Holder<AccelStructHandle>>,
    _buffers: Vec<MeshBuffers>,
}

impl Scene {
    fn new(ctx: &Context, meshes: &[Mesh], Build(flags, order): Build) -> lvk::Result<Self> {
        let buffers =
            meshes.iter().map(|mesh| MeshBuffers::new(ctx, mesh)).collect::<lvk::Result<Vec<_>>>()?;
        let geometries: Vec<_> = buffers.iter().map(|buffers| [buffers.geometry()]).collect();
        let descs: Vec<_> = geometries
            .iter()
            .map(|geometries| BlasDesc { geometries, flags, order, debug_name: "mesh" })
            .collect();
        let blas = ctx.create_blas_batch(&descs)?;
        let instances: Vec<_> = blas.iter().map(|blas| TlasInstance::new(**blas)).collect();
        let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..TlasDesc::default() })?;
        ctx.wait(ctx.flush()?)?;
        Ok(Self { tlas, _blas: blas, _buffers: buffers })
    }
}
