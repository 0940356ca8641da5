//! Triangle orders: given order, Morton order, the library's spatial order.

use std::time::Instant;

use lvk::{Context, PrimitiveOrder};

use crate::args::TraceArgs;
use crate::error::BenchError;
use crate::measure::{Stopwatch, elapsed_ms, interleave, median_of};
use crate::mesh::{BuiltMesh, Mesh, MeshBuffers};
use crate::morton::morton_order;
use crate::setup::{DefaultBy, Setup, path_name, ray_paths};
use crate::table::{Table, format_ms, format_ratio};
use crate::tracer::{MeshTracer, RayKind, TracedImage};
use lvk_samples::hybrid::RayPath;

/// Compares rays per second for the same triangles in three orders.
pub(super) fn measure(setup: &Setup, args: &TraceArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let (paths, missing) = ray_paths(&ctx)?;
    let default_triangles = setup.default_for(&ctx, DefaultBy { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 7, gpu: 60 });
    let mesh = Mesh::new(&args.mesh, args.camera, default_triangles)?;
    let size = setup.image_size(&ctx, &args.image);
    let title = setup.title(&ctx, &format!("order: {}, {}x{}", mesh.describe(), size[0], size[1]));
    let columns = ["", "given order", "Morton", "spatial", "Morton speed-up", "spatial speed-up"];
    let mut table = Table::new(title, &columns);
    let orders = create_orders(&ctx, &mesh, size)?;
    let [given, morton, spatial] = &orders;
    table.add_row("sorting on the CPU by the benchmark", [String::new(), format_ms(morton.sorting)]);
    table.add_row(
        "creation, with sorting by lvk",
        [format_ms(given.creation), format_ms(morton.creation), format_ms(spatial.creation)],
    );
    for path in paths {
        add_comparison_rows(&ctx, &orders, path, runs, &mut table)?;
    }
    let is_default = ctx.capabilities().prefers_spatial_order;
    missing.into_iter().for_each(|note| table.add_note(note));
    table.add_note(format!("rays per second by the medians of {runs} interleaved frames; shadow rays only where a primary ray hit"));
    table.add_note(format!(
        "PrimitiveOrder::Auto selects the spatial order on this driver: {}",
        if is_default { "yes" } else { "no" }
    ));
    table.add_note("aim on the software driver: 3x the rate of the given order");
    Ok(table)
}

/// The mesh in one order.
struct OrderedMesh {
    _scene: BuiltMesh,
    image: TracedImage,
    /// Milliseconds of the sorting by the benchmark on the CPU.
    sorting: f64,
    /// Milliseconds from the creation of BLAS and TLAS until the GPU was done.
    creation: f64,
}

fn create_orders(ctx: &Context, mesh: &Mesh, size: [u32; 2]) -> Result<[OrderedMesh; 3], BenchError> {
    let start = Instant::now();
    let triangles = morton_order(&mesh.positions, &mesh.triangles);
    let sorting = elapsed_ms(start);
    let morton = Mesh { triangles, ..mesh.clone() };
    Ok([
        OrderedMesh::new(ctx, mesh, size, PrimitiveOrder::Given, 0.0)?,
        OrderedMesh::new(ctx, &morton, size, PrimitiveOrder::Given, sorting)?,
        OrderedMesh::new(ctx, mesh, size, PrimitiveOrder::Spatial, 0.0)?,
    ])
}

impl OrderedMesh {
    fn new(
        ctx: &Context,
        mesh: &Mesh,
        size: [u32; 2],
        order: PrimitiveOrder,
        sorting: f64,
    ) -> Result<Self, BenchError> {
        let buffers = MeshBuffers::new(ctx, mesh)?;
        ctx.wait(ctx.flush()?)?;
        let start = Instant::now();
        let scene = BuiltMesh::new(ctx, buffers, order)?;
        let creation = elapsed_ms(start);
        let image = TracedImage::new(ctx, mesh, size, scene.tlas.index())?;
        Ok(Self { _scene: scene, image, sorting, creation })
    }
}

/// Adds the rows of one path, for both kinds of rays.
fn add_comparison_rows(
    ctx: &Context,
    orders: &[OrderedMesh; 3],
    path: RayPath,
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let tracer = MeshTracer::new(ctx, path)?;
    let stopwatch = Stopwatch::new(ctx)?;
    for rays in RayKind::BOTH {
        let samples: [Vec<_>; 3] =
            interleave(runs, |which| stopwatch.time(|cmd| tracer.record(cmd, &orders[which].image, rays)))?;
        let medians = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        let count = orders[0].image.ray_count(rays)?;
        let rates = medians.map(|time| format!("{:.3} M/s", count as f64 / time / 1e3));
        let gains = [1, 2].map(|which| format_ratio(medians[0] / medians[which]));
        table.add_row(format!("{} by {}", rays.name(), path_name(path)), rates.into_iter().chain(gains));
    }
    let differing = orders[0].image.count_differing_pixels(&orders[2].image)?;
    let name = format!("differing pixels by {}", path_name(path));
    table.add_row(name, [String::new(), String::new(), differing.to_string()]);
    Ok(())
}
