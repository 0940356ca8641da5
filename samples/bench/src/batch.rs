//! Many small meshes: one batch against a submission and a wait for each.

use std::time::Instant;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, Context, ContextDesc, Holder, IndexFormat, Indices,
    PrimitiveOrder, Triangles,
};

use super::args::BatchArgs;
use super::error::BenchError;
use super::measure::{median_of, since, take_turns};
use super::mesh::{MeshBuffers, input};
use super::setup::{Choice, Setup};
use super::table::{Table, bytes, grouped, ms, times};

type Holders = Vec<Holder<AccelStructHandle>>;

/// Compares a batch with one submission and wait for each mesh, and the batch with one that has little scratch memory.
pub(super) fn measure(setup: &Setup, args: &BatchArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let [meshes, triangles] = setup.choose(&ctx, Choice { quick: [20, 50], cpu: [1000; 2], gpu: [1000; 2] });
    let [meshes, triangles] = [args.meshes.unwrap_or(meshes), args.triangles.unwrap_or(triangles)];
    let runs = setup.runs(&ctx, Choice { quick: 1, cpu: 3, gpu: 10 });
    let what = format!(
        "batch: {} meshes of {} triangles",
        grouped(u64::from(meshes)),
        grouped(u64::from(triangles))
    );
    let mut table =
        Table::new(setup.headline(&ctx, &what), &["builds, until the GPU is done", "time", "a mesh"]);
    let budget = compare(&ctx, meshes, triangles, runs, &mut table)?;
    drop(ctx);
    squeeze(setup, meshes, triangles, runs, budget, &mut table)?;
    table.note(format!("medians of {runs} runs, taken in turns; triangles in the order given"));
    table.note("limit: the batch at least 5 times faster on the H200, scratch never above its budget");
    Ok(table)
}

/// Rows of both ways; answers a budget for scratch memory that all builds together exceed several times.
fn compare(
    ctx: &Context,
    meshes: u32,
    triangles: u32,
    runs: u32,
    table: &mut Table,
) -> Result<u64, BenchError> {
    let grids = Grids::new(ctx, meshes, triangles)?;
    let [batch, each] =
        take_turns(runs, |which| if which == 0 { grids.batch(ctx) } else { grids.each(ctx) })?;
    let [batch, each] = [batch, each].map(|samples| median_of(&samples, |time| *time));
    let cells = |time: f64| [ms(time), format!("{:.2} us", 1e3 * time / f64::from(meshes))];
    table.row("one batch", cells(batch));
    table.row("a submission and a wait for each", cells(each));
    table.row("ratio", [times(each / batch)]);
    let budget = ContextDesc::default().scratch_budget_bytes;
    table.row("peak of scratch memory", scratch_cells(ctx, budget));
    let one = ctx.blas_sizes(&grids.descs()[0])?.build_scratch_bytes;
    let alignment = u64::from(ctx.capabilities().limits.scratch_alignment).max(1);
    let all = one.next_multiple_of(alignment) * u64::from(meshes);
    table.row("scratch memory of all builds together", [bytes(all)]);
    Ok((all / 8).max(16 * (one + alignment)))
}

/// Rows of a batch with so little scratch memory that it takes several submissions.
fn squeeze(
    setup: &Setup,
    meshes: u32,
    triangles: u32,
    runs: u32,
    budget: u64,
    table: &mut Table,
) -> Result<(), BenchError> {
    let ctx = setup.open_with(budget)?;
    let grids = Grids::new(&ctx, meshes, triangles)?;
    let [samples] = take_turns(runs, |_| grids.batch(&ctx))?;
    let time = median_of(&samples, |time| *time);
    let name = format!("one batch, scratch budget {}", bytes(budget));
    table.row(name, [ms(time), format!("{:.2} us", 1e3 * time / f64::from(meshes))]);
    table.row("peak of scratch memory then", scratch_cells(&ctx, budget));
    Ok(())
}

fn scratch_cells(ctx: &Context, budget: u64) -> [String; 2] {
    let scratch = ctx.accel_memory().scratch_bytes;
    [bytes(scratch), format!("{:.1} % of budget", 100.0 * scratch as f64 / budget as f64)]
}

/// Wavy patches, all in one pair of buffers.
struct Grids {
    buffers: MeshBuffers,
    /// Bytes from the indices of one mesh to those of the next.
    stride_bytes: u64,
    geometries: Vec<[BlasGeometry; 1]>,
}

impl Grids {
    fn new(ctx: &Context, meshes: u32, triangles: u32) -> Result<Self, BenchError> {
        let columns = f64::from(triangles).div_euclid(2.0).sqrt().ceil().max(1.0) as u32;
        let rows = triangles.div_ceil(2 * columns);
        let place = |mesh: u32| {
            (0..(rows + 1) * (columns + 1)).map(move |vertex| vertex_at(mesh, vertex, columns + 1))
        };
        let positions: Vec<[f32; 3]> = (0..meshes).flat_map(place).collect();
        let grid = (0..triangles).map(|triangle| triangle_at(triangle, columns));
        let indices: Vec<[u32; 3]> = grid.collect();
        let buffers = MeshBuffers {
            positions: input(ctx, "positions", bytemuck::cast_slice(&positions))?,
            indices: input(ctx, "indices", bytemuck::cast_slice(&indices))?,
            vertex_count: (rows + 1) * (columns + 1),
            triangle_count: triangles,
        };
        let stride_bytes = u64::from(buffers.vertex_count) * 12;
        let mut grids = Self { buffers, stride_bytes, geometries: Vec::new() };
        grids.geometries = (0..meshes).map(|mesh| [grids.geometry(mesh)]).collect();
        ctx.wait(ctx.flush()?)?;
        Ok(grids)
    }

    fn geometry(&self, mesh: u32) -> BlasGeometry {
        let MeshBuffers { positions, indices, vertex_count, triangle_count } = &self.buffers;
        BlasGeometry::Triangles(Triangles {
            vertex_offset: u64::from(mesh) * self.stride_bytes,
            indices: Some(Indices { buffer: **indices, offset: 0, format: IndexFormat::U32 }),
            triangle_count: *triangle_count,
            ..Triangles::packed(**positions, *vertex_count)
        })
    }

    fn descs(&self) -> Vec<BlasDesc<'_>> {
        let desc = |geometries| BlasDesc { geometries, order: PrimitiveOrder::Given, ..BlasDesc::default() };
        self.geometries.iter().map(|geometries| desc(geometries)).collect()
    }

    /// Milliseconds of one batch.
    fn batch(&self, ctx: &Context) -> Result<f64, BenchError> {
        let start = Instant::now();
        let made = ctx.create_blas_batch(&self.descs())?;
        ctx.wait(ctx.flush()?)?;
        let time = since(start);
        clear(ctx, made)?;
        Ok(time)
    }

    /// Milliseconds of a submission and a wait for each.
    fn each(&self, ctx: &Context) -> Result<f64, BenchError> {
        let mut made = Holders::with_capacity(self.geometries.len());
        let start = Instant::now();
        for desc in self.descs() {
            made.push(ctx.create_blas(&desc)?);
            ctx.wait(ctx.flush()?)?;
        }
        let time = since(start);
        clear(ctx, made)?;
        Ok(time)
    }
}

/// Gives the memory back before the next run.
fn clear(ctx: &Context, made: Holders) -> lvk::Result<()> {
    drop(made);
    ctx.wait_idle()
}

fn vertex_at(mesh: u32, vertex: u32, columns: u32) -> [f32; 3] {
    let [x, z] = [vertex % columns, vertex / columns].map(|place| place as f32 / columns as f32);
    let phase = 0.1 * mesh as f32;
    [x, 0.1 * (9.0 * x + phase).sin() * (7.0 * z - phase).cos(), z]
}

fn triangle_at(triangle: u32, columns: u32) -> [u32; 3] {
    let (row, column) = (triangle / 2 / columns, triangle / 2 % columns);
    let corner = row * (columns + 1) + column;
    match triangle % 2 {
        0 => [corner, corner + 1, corner + columns + 1],
        _ => [corner + 1, corner + columns + 2, corner + columns + 1],
    }
}
