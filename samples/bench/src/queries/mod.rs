//! Ray queries walked by the library, beside the device's own tracing: rays a second, agreement, memory, builds.

mod agreement;
mod creation;
mod devices;
mod instances;
mod pieces;
mod rates;
mod sides;
mod structures;
mod walk;

use super::args::QueriesArgs;
use super::error::BenchError;
use super::mesh::Mesh;
use super::setup::{Choice, Setup};
use super::table::Table;
use devices::Devices;
use sides::sides;
use walk::{Plan, walk};

/// Compares software with the device at the same mesh.
pub(super) fn measure(setup: &Setup, args: &QueriesArgs) -> Result<Vec<Table>, BenchError> {
    let devices = Devices::open(setup)?;
    let ctx = &devices.both;
    let default_triangles = setup.choose(ctx, Choice { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(ctx, Choice { quick: 1, cpu: 3, gpu: 30 });
    let size = setup.picture_size(ctx, &args.picture);
    let mesh = Mesh::new(&args.mesh, args.camera.unwrap_or(1), default_triangles)?;
    let cameras = if args.camera.is_some() { vec![mesh.camera] } else { mesh.cameras.to_vec() };
    let what = format!("queries: {}, {}x{}", mesh.describe(), size[0], size[1]);
    let headline = setup.headline(ctx, &what);
    let plan = Plan { cameras, size, runs };
    let mut tables = traced(&devices, &mesh, args.instances, &plan, headline)?;
    tables.push(structures::table(setup, &devices, &mesh, runs)?);
    Ok(tables)
}

/// The tables of what rays find and how fast.
fn traced(
    devices: &Devices,
    mesh: &Mesh,
    pieces: u32,
    plan: &Plan,
    headline: String,
) -> Result<Vec<Table>, BenchError> {
    let sides = sides(devices, mesh, pieces)?;
    let walked = walk(&sides.all, mesh, plan)?;
    let mut whole = rates::whole(headline, &walked, plan);
    devices.missing().into_iter().for_each(|note| whole.note(note));
    Ok(vec![whole, rates::cut(sides.piece_count, &walked), agreement::table(&walked)])
}
