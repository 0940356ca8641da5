//! Ray tracing cost of a mesh split into several BLAS, compared with one BLAS.

use lvk::{Context, PrimitiveOrder};

use crate::args::SplitArgs;
use crate::error::BenchError;
use crate::measure::{Stopwatch, interleave, median_of};
use crate::mesh::{BuiltMesh, Mesh, MeshBuffers};
use crate::setup::{DefaultBy, Setup, path_name, ray_paths};
use crate::table::{Table, format_ms, format_ratio};
use crate::tracer::{MeshTracer, RayKind, TracedImage};
use lvk_samples::hybrid::RayPath;

/// Compares traces of the whole mesh and of the mesh split by a device profile with few primitives per BLAS.
pub(super) fn measure(setup: &Setup, args: &SplitArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let (paths, missing) = ray_paths(&ctx)?;
    let default_triangles = setup.default_for(&ctx, DefaultBy { quick: 2000, cpu: 100_000, gpu: 1_000_000 });
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 21, gpu: 60 });
    let mesh = Mesh::new(&args.trace.mesh, args.trace.camera, default_triangles)?;
    let size = setup.image_size(&ctx, &args.trace.image);
    let title = setup.title(&ctx, &format!("split: {}, {}x{}", mesh.describe(), size[0], size[1]));
    let most = (mesh.triangles.len() as u64 / u64::from(args.parts)).max(1);
    let cases = [ctx, setup.open_limited(most)?];
    let [whole, split] = cases.map(|ctx| SplitCase::new(ctx, &mesh, size));
    let cases = [whole?, split?];
    let parts = cases[1].ctx.accel_struct_info(*cases[1].scene.blas)?.parts;
    let split_head = format!("{parts} parts");
    let mut table = Table::new(title, &["GPU time", "whole", &split_head, "ratio"]);
    for path in paths {
        add_comparison_rows(&cases, path, runs, &mut table)?;
    }
    missing.into_iter().for_each(|note| table.add_note(note));
    table.add_note(format!("medians of {runs} interleaved frames; at most {most} triangles per part"));
    table.add_note("limit: 1.15x");
    Ok(table)
}

/// One context with the mesh.
struct SplitCase {
    ctx: Context,
    scene: BuiltMesh,
    image: TracedImage,
    stopwatch: Stopwatch,
}

impl SplitCase {
    fn new(ctx: Context, mesh: &Mesh, size: [u32; 2]) -> Result<Self, BenchError> {
        let scene = BuiltMesh::new(&ctx, MeshBuffers::new(&ctx, mesh)?, PrimitiveOrder::Auto)?;
        let image = TracedImage::new(&ctx, mesh, size, scene.tlas.index())?;
        Ok(Self { stopwatch: Stopwatch::new(&ctx)?, ctx, scene, image })
    }
}

/// Adds the rows of one path, for both kinds of rays.
fn add_comparison_rows(
    cases: &[SplitCase; 2],
    path: RayPath,
    runs: u32,
    table: &mut Table,
) -> Result<(), BenchError> {
    let tracers = [MeshTracer::new(&cases[0].ctx, path)?, MeshTracer::new(&cases[1].ctx, path)?];
    for rays in RayKind::BOTH {
        let samples: [Vec<_>; 2] = interleave(runs, |which| {
            let case = &cases[which];
            case.stopwatch.time(|cmd| tracers[which].record(cmd, &case.image, rays))
        })?;
        let [whole, split] = samples.map(|samples| median_of(&samples, |timed| timed.gpu));
        let name = format!("{} by {}", rays.name(), path_name(path));
        table.add_row(name, [format_ms(whole), format_ms(split), format_ratio(split / whole)]);
    }
    let (differing, all) = (cases[0].image.count_differing_pixels(&cases[1].image)?, cases[0].image.size);
    let all = all[0] * all[1];
    table.add_row(
        format!("differing pixels by {}", path_name(path)),
        [String::new(), format!("{differing} of {all}")],
    );
    Ok(())
}
