//! A mesh whole and split into parts: what tracing costs.

use lvk::{Context, PrimitiveOrder};

use super::args::SplitArgs;
use super::error::BenchError;
use super::measure::{Stopwatch, median_of, take_turns};
use super::mesh::{Mesh, MeshBuffers, Traceable};
use super::setup::{Choice, Setup, path_name, ray_paths};
use super::table::{Table, ms, times};
use super::tracer::{Picture, Rays, Tracer};
use lvk_samples::hybrid::RayPath;

/// Compares traces of the mesh whole and split by a profile that allows few primitives in a structure.
pub(super) fn measure(setup: &Setup, args: &SplitArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let (paths, missing) = ray_paths(&ctx)?;
    let default_triangles = setup.choose(&ctx, Choice { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, Choice { quick: 1, cpu: 21, gpu: 60 });
    let mesh = Mesh::new(&args.trace.mesh, args.trace.camera, default_triangles)?;
    let size = setup.picture_size(&ctx, &args.trace.picture);
    let headline = setup.headline(&ctx, &format!("split: {}, {}x{}", mesh.describe(), size[0], size[1]));
    let most = (mesh.triangles.len() as u64 / u64::from(args.parts)).max(1);
    let sides = [ctx, setup.open_limited(most)?];
    let [whole, split] = sides.map(|ctx| Side::new(ctx, &mesh, size));
    let sides = [whole?, split?];
    let parts = sides[1].ctx.accel_struct_info(*sides[1].scene.blas)?.parts;
    let split_head = format!("{parts} parts");
    let mut table = Table::new(headline, &["GPU time", "whole", &split_head, "ratio"]);
    for path in paths {
        compare(&sides, path, runs, &mut table)?;
    }
    missing.into_iter().for_each(|note| table.note(note));
    table.note(format!("medians of {runs} frames, taken in turns; parts hold at most {most} triangles"));
    table.note("limit: 1.15x on the H200, 1.3x on the software driver");
    Ok(table)
}

/// One device with the mesh.
struct Side {
    ctx: Context,
    scene: Traceable,
    picture: Picture,
    stopwatch: Stopwatch,
}

impl Side {
    fn new(ctx: Context, mesh: &Mesh, size: [u32; 2]) -> Result<Self, BenchError> {
        let scene = Traceable::new(&ctx, MeshBuffers::new(&ctx, mesh)?, PrimitiveOrder::Auto)?;
        let picture = Picture::new(&ctx, mesh, size, scene.tlas.index())?;
        Ok(Self { stopwatch: Stopwatch::new(&ctx)?, ctx, scene, picture })
    }
}

/// Rows of one path, for both kinds of rays.
fn compare(sides: &[Side; 2], path: RayPath, runs: u32, table: &mut Table) -> Result<(), BenchError> {
    let tracers = [Tracer::new(&sides[0].ctx, path)?, Tracer::new(&sides[1].ctx, path)?];
    for rays in Rays::BOTH {
        let samples: [Vec<_>; 2] = take_turns(runs, |which| {
            let side = &sides[which];
            side.stopwatch.time(|cmd| tracers[which].record(cmd, &side.picture, rays))
        })?;
        let [whole, split] = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        let name = format!("{} by {}", rays.name(), path_name(path));
        table.row(name, [ms(whole), ms(split), times(split / whole)]);
    }
    let (differing, all) = (sides[0].picture.differing(&sides[1].picture)?, sides[0].picture.size);
    let all = all[0] * all[1];
    table.row(
        format!("pixels that differ by {}", path_name(path)),
        [String::new(), format!("{differing} of {all}")],
    );
    Ok(())
}
