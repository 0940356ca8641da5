//! Software ray queries of the library, compared with the driver's ray tracing: rays per second, hit agreement, memory and
//! builds.

mod accel_structs;
mod contexts;
mod cpu_builds;
mod hit_agreement;
mod instances;
mod mesh_chunks;
mod rates;
mod tracers;
mod traversal;

use super::args::QueriesArgs;
use super::error::BenchError;
use super::mesh::Mesh;
use super::setup::{DefaultBy, Setup};
use super::table::Table;
use contexts::Contexts;
use tracers::TracerCases;
use traversal::{TraversalPlan, measure_traversal};

/// Compares software ray queries with the driver's ray tracing on the same mesh.
pub(super) fn measure(setup: &Setup, args: &QueriesArgs) -> Result<Vec<Table>, BenchError> {
    let contexts = Contexts::open(setup)?;
    let ctx = &contexts.both;
    let default_triangles = setup.default_for(ctx, DefaultBy { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(ctx, DefaultBy { quick: 1, cpu: 3, gpu: 30 });
    let size = setup.image_size(ctx, &args.image);
    let mesh = Mesh::new(&args.mesh, args.camera.unwrap_or(1), default_triangles)?;
    let cameras = if args.camera.is_some() { vec![mesh.camera] } else { mesh.cameras.to_vec() };
    let what = format!("queries: {}, {}x{}", mesh.describe(), size[0], size[1]);
    let title = setup.title(ctx, &what);
    let plan = TraversalPlan { cameras, size, runs };
    let mut tables = measure_tracing(&contexts, &mesh, args.instances, &plan, title)?;
    tables.push(accel_structs::table(setup, &contexts, &mesh, runs)?);
    Ok(tables)
}

/// Measures the traversal and returns the tables of rates and hit agreement.
fn measure_tracing(
    contexts: &Contexts,
    mesh: &Mesh,
    chunk_count: u32,
    plan: &TraversalPlan,
    title: String,
) -> Result<Vec<Table>, BenchError> {
    let cases = TracerCases::new(contexts, mesh, chunk_count)?;
    let results = measure_traversal(&cases.all, mesh, plan)?;
    let mut whole = rates::single_instance_table(title, &results, plan);
    contexts.unmeasured().into_iter().for_each(|note| whole.add_note(note));
    Ok(vec![whole, rates::chunks_table(cases.chunk_count, &results), hit_agreement::table(&results)])
}
