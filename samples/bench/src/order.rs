//! Orders of triangles: as given, along a Morton curve, by the library.

use std::time::Instant;

use lvk::{Context, PrimitiveOrder};

use super::args::TraceArgs;
use super::error::BenchError;
use super::measure::{Stopwatch, median_of, since, take_turns};
use super::mesh::{Mesh, MeshBuffers, Traceable};
use super::morton::morton_order;
use super::setup::{Choice, Setup, path_name, ray_paths};
use super::table::{Table, ms, times};
use super::tracer::{Picture, Rays, Tracer};
use lvk_samples::hybrid::RayPath;

/// Compares rays a second through the same triangles in three orders.
pub(super) fn measure(setup: &Setup, args: &TraceArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let (paths, missing) = ray_paths(&ctx)?;
    let default_triangles = setup.choose(&ctx, Choice { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, Choice { quick: 1, cpu: 7, gpu: 60 });
    let mesh = Mesh::new(&args.mesh, args.camera, default_triangles)?;
    let size = setup.picture_size(&ctx, &args.picture);
    let headline = setup.headline(&ctx, &format!("order: {}, {}x{}", mesh.describe(), size[0], size[1]));
    let columns = ["", "as given", "Morton", "spatial", "Morton gains", "spatial gains"];
    let mut table = Table::new(headline, &columns);
    let sides = sides(&ctx, &mesh, size)?;
    let [given, morton, spatial] = &sides;
    table.row("ordering on the host by the benchmark", [String::new(), ms(morton.sorting)]);
    table.row(
        "creation, ordering by lvk included",
        [ms(given.creation), ms(morton.creation), ms(spatial.creation)],
    );
    for path in paths {
        compare(&ctx, &sides, path, runs, &mut table)?;
    }
    let is_default = ctx.capabilities().prefers_spatial_order;
    missing.into_iter().for_each(|note| table.note(note));
    table.note(format!("rays a second by the medians of {runs} frames, taken in turns; shadow rays only where a primary ray hit"));
    table.note(format!(
        "the library orders by itself on this driver: {}",
        if is_default { "yes" } else { "no" }
    ));
    table.note("aim on the software driver: 3x over the given order");
    Ok(table)
}

/// The mesh in one order.
struct Side {
    _scene: Traceable,
    picture: Picture,
    /// Milliseconds that sorting took on the host, before the library saw the mesh.
    sorting: f64,
    /// Milliseconds from the creation of the structures until the GPU was done.
    creation: f64,
}

fn sides(ctx: &Context, mesh: &Mesh, size: [u32; 2]) -> Result<[Side; 3], BenchError> {
    let start = Instant::now();
    let triangles = morton_order(&mesh.positions, &mesh.triangles);
    let sorting = since(start);
    let morton = Mesh { triangles, ..mesh.clone() };
    Ok([
        Side::new(ctx, mesh, size, PrimitiveOrder::Given, 0.0)?,
        Side::new(ctx, &morton, size, PrimitiveOrder::Given, sorting)?,
        Side::new(ctx, mesh, size, PrimitiveOrder::Spatial, 0.0)?,
    ])
}

impl Side {
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
        let scene = Traceable::new(ctx, buffers, order)?;
        let creation = since(start);
        let picture = Picture::new(ctx, mesh, size, scene.tlas.index())?;
        Ok(Self { _scene: scene, picture, sorting, creation })
    }
}

/// Rows of one path, for both kinds of rays.
fn compare(
    ctx: &Context,
    sides: &[Side; 3],
    path: RayPath,
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let tracer = Tracer::new(ctx, path)?;
    let stopwatch = Stopwatch::new(ctx)?;
    for rays in Rays::BOTH {
        let samples: [Vec<_>; 3] =
            take_turns(runs, |which| stopwatch.time(|cmd| tracer.record(cmd, &sides[which].picture, rays)))?;
        let medians = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        let count = sides[0].picture.ray_count(rays)?;
        let rates = medians.map(|time| format!("{:.3} M/s", count as f64 / time / 1e3));
        let gains = [1, 2].map(|which| times(medians[0] / medians[which]));
        table.row(format!("{} by {}", rays.name(), path_name(path)), rates.into_iter().chain(gains));
    }
    let differing = sides[0].picture.differing(&sides[2].picture)?;
    let name = format!("pixels that differ by {}", path_name(path));
    table.row(name, [String::new(), String::new(), differing.to_string()]);
    Ok(())
}
