//! BLAS builds of many small meshes: one batch compared with one submission and wait per mesh.

use std::time::Instant;

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, Context, ContextDesc, Holder, IndexFormat, Indices,
    PrimitiveOrder, Triangles,
};

use crate::args::BatchArgs;
use crate::error::BenchError;
use crate::measure::{elapsed_ms, interleave, median_of};
use crate::mesh::{MeshBuffers, create_input_buffer};
use crate::setup::{DefaultBy, Setup};
use crate::table::{Table, format_bytes, format_grouped, format_ms, format_ratio};

type Holders = Vec<Holder<AccelStructHandle>>;

/// Compares a batch with one submission and wait per mesh, and with a batch that has a small scratch budget.
pub(super) fn measure(setup: &Setup, args: &BatchArgs) -> Result<Table, BenchError> {
    let ctx = setup.open()?;
    let [meshes, triangles] =
        setup.default_for(&ctx, DefaultBy { quick: [20, 50], cpu: [1000; 2], gpu: [1000; 2] });
    let [meshes, triangles] = [args.meshes.unwrap_or(meshes), args.triangles.unwrap_or(triangles)];
    let runs = setup.runs(&ctx, DefaultBy { quick: 1, cpu: 3, gpu: 10 });
    let what = format!(
        "batch: {} meshes of {} triangles",
        format_grouped(u64::from(meshes)),
        format_grouped(u64::from(triangles))
    );
    let mut table =
        Table::new(setup.title(&ctx, &what), &["builds, until the GPU is done", "time", "per mesh"]);
    let budget = add_comparison_rows(&ctx, meshes, triangles, runs, &mut table)?;
    drop(ctx);
    add_small_budget_rows(setup, meshes, triangles, runs, budget, &mut table)?;
    table.add_note(format!("medians of {runs} interleaved runs; triangles in the given order"));
    table.add_note("limit: the batch at least 5 times faster on the H200, scratch never above its budget");
    Ok(table)
}

/// Adds the rows of both variants. Returns a scratch budget that is an eighth of the memory of all builds, or enough for 16.
fn add_comparison_rows(
    ctx: &Context,
    meshes: u32,
    triangles: u32,
    runs: u32,
    table: &mut Table,
) -> Result<u64, BenchError> {
    let grids = Grids::new(ctx, meshes, triangles)?;
    let [batch, each] =
        interleave(
            runs,
            |which| if which == 0 { grids.build_batch(ctx) } else { grids.build_one_by_one(ctx) },
        )?;
    let [batch, each] = [batch, each].map(|samples| median_of(&samples, |time| *time));
    let cells = |time: f64| [format_ms(time), format!("{:.2} us", 1e3 * time / f64::from(meshes))];
    table.add_row("one batch", cells(batch));
    table.add_row("one submission and wait per mesh", cells(each));
    table.add_row("ratio", [format_ratio(each / batch)]);
    let budget = ContextDesc::default().scratch_budget_bytes;
    table.add_row("peak scratch memory", scratch_cells(ctx, budget));
    let one = ctx.blas_sizes(&grids.descs()[0])?.build_scratch_bytes;
    let alignment = u64::from(ctx.capabilities().limits.scratch_alignment).max(1);
    let all = one.next_multiple_of(alignment) * u64::from(meshes);
    table.add_row("scratch memory of all builds, summed", [format_bytes(all)]);
    Ok((all / 8).max(16 * (one + alignment)))
}

/// Adds the rows of a batch whose small scratch budget requires several submissions.
fn add_small_budget_rows(
    setup: &Setup,
    meshes: u32,
    triangles: u32,
    runs: u32,
    budget: u64,
    table: &mut Table,
) -> Result<(), BenchError> {
    let ctx = setup.open_with(budget)?;
    let grids = Grids::new(&ctx, meshes, triangles)?;
    let [samples] = interleave(runs, |_| grids.build_batch(&ctx))?;
    let time = median_of(&samples, |time| *time);
    let name = format!("one batch, scratch budget {}", format_bytes(budget));
    table.add_row(name, [format_ms(time), format!("{:.2} us", 1e3 * time / f64::from(meshes))]);
    table.add_row("peak scratch memory, small budget", scratch_cells(&ctx, budget));
    Ok(())
}

fn scratch_cells(ctx: &Context, budget: u64) -> [String; 2] {
    let scratch = ctx.accel_memory().scratch_bytes;
    [format_bytes(scratch), format!("{:.1} % of budget", 100.0 * scratch as f64 / budget as f64)]
}

/// Wavy grids that share one vertex buffer and one index buffer.
struct Grids {
    buffers: MeshBuffers,
    /// Bytes from the vertices of one mesh to those of the next.
    stride_bytes: u64,
    geometries: Vec<[BlasGeometry; 1]>,
}

impl Grids {
    fn new(ctx: &Context, meshes: u32, triangles: u32) -> Result<Self, BenchError> {
        let columns = f64::from(triangles).div_euclid(2.0).sqrt().ceil().max(1.0) as u32;
        let rows = triangles.div_ceil(2 * columns);
        let mesh_vertices = |mesh: u32| {
            (0..(rows + 1) * (columns + 1)).map(move |vertex| vertex_at(mesh, vertex, columns + 1))
        };
        let positions: Vec<[f32; 3]> = (0..meshes).flat_map(mesh_vertices).collect();
        let grid = (0..triangles).map(|triangle| triangle_at(triangle, columns));
        let indices: Vec<[u32; 3]> = grid.collect();
        let buffers = MeshBuffers {
            positions: create_input_buffer(ctx, "positions", bytemuck::cast_slice(&positions))?,
            indices: create_input_buffer(ctx, "indices", bytemuck::cast_slice(&indices))?,
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

    /// Builds all meshes in one batch and returns the milliseconds.
    fn build_batch(&self, ctx: &Context) -> Result<f64, BenchError> {
        let start = Instant::now();
        let made = ctx.create_blas_batch(&self.descs())?;
        ctx.wait(ctx.flush()?)?;
        let time = elapsed_ms(start);
        free_and_wait(ctx, made)?;
        Ok(time)
    }

    /// Builds the meshes with one submission and wait each and returns the milliseconds.
    fn build_one_by_one(&self, ctx: &Context) -> Result<f64, BenchError> {
        let mut made = Holders::with_capacity(self.geometries.len());
        let start = Instant::now();
        for desc in self.descs() {
            made.push(ctx.create_blas(&desc)?);
            ctx.wait(ctx.flush()?)?;
        }
        let time = elapsed_ms(start);
        free_and_wait(ctx, made)?;
        Ok(time)
    }
}

/// Frees the BLAS before the next run.
fn free_and_wait(ctx: &Context, made: Holders) -> lvk::Result<()> {
    drop(made);
    ctx.wait_idle()
}

fn vertex_at(mesh: u32, vertex: u32, columns: u32) -> [f32; 3] {
    let [x, z] = [vertex % columns, vertex / columns].map(|cell| cell as f32 / columns as f32);
    let phase = 0.1 * mesh as f32;
    [x, 0.1 * (9.0 * x + phase).sin() * (7.0 * z - phase).cos(), z]
}

fn triangle_at(triangle: u32, columns: u32) -> [u32; 3] {
    let (row, column) = (triangle / 2 / columns, triangle / 2 % columns);
    let vertex = row * (columns + 1) + column;
    match triangle % 2 {
        0 => [vertex, vertex + 1, vertex + columns + 1],
        _ => [vertex + 1, vertex + columns + 2, vertex + columns + 1],
    }
}
