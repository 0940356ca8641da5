//! Geometries that share one large vertex buffer and use few of its vertices each.

use lvk::{
    BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags, BuildMode, Context, Holder,
    IndexFormat, Indices, Result, TlasDesc, TlasInstance, Triangles,
};
use lvk_tests::accel_backend::software_alone;
use lvk_tests::ray_tracer::{How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;

struct Shared {
    vertices: Holder<BufferHandle>,
    indices: Holder<BufferHandle>,
    vertex_count: u32,
}

impl Shared {
    /// Creates small triangles in a row along x. The rest of `vertex_count` vertices is at the origin.
    fn new(ctx: &Context, vertex_count: u32, triangles: u32) -> Result<Self> {
        let corners = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]];
        let mut positions = vec![[0.0_f32; 3]; vertex_count as usize];
        for (number, position) in positions.iter_mut().take(triangles as usize * 3).enumerate() {
            let [x, y] = corners[number % 3];
            *position = [(number / 3) as f32 + x, y, 0.0];
        }
        let indices: Vec<u32> = (0..triangles * 3).collect();
        let buffer = |bytes| {
            let usage = BufferUsage::ACCEL_INPUT | BufferUsage::STORAGE;
            ctx.create_buffer(&BufferDesc { usage, data: Some(bytes), ..Default::default() })
        };
        let vertices = buffer(bytemuck::cast_slice(&positions))?;
        Ok(Self { vertices, indices: buffer(bytemuck::cast_slice(&indices))?, vertex_count })
    }

    /// Returns `count` geometries of `each` triangles. Each may index all vertices.
    fn geometries(&self, count: u32, each: u32) -> Vec<BlasGeometry> {
        let geometry = |number: u32| {
            let offset = u64::from(number * each * 12);
            let indices = Indices { buffer: *self.indices, offset, format: IndexFormat::U32 };
            BlasGeometry::Triangles(Triangles {
                indices: Some(indices),
                triangle_count: each,
                ..Triangles::packed(*self.vertices, self.vertex_count)
            })
        };
        (0..count).map(geometry).collect()
    }
}

/// A ray down on every hundredth of the triangles.
fn check(ctx: &Context, mesh: &TlasInstance, count: u32) -> Result<()> {
    let shown = [*mesh];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &shown, ..Default::default() })?;
    let numbers: Vec<u32> = (0..count).step_by(100).collect();
    let ray = |number: &u32| Ray::new([*number as f32 + 0.125, 0.125, 1.0].into(), [0.0, 0.0, -1.0].into());
    let rays: Vec<_> = numbers.iter().map(ray).collect();
    let hits = RayTracer::new(ctx, Method::Query)?.trace(&tlas, &rays, How::default())?;
    for (hit, number) in hits.iter().zip(numbers) {
        assert!(hit.kind != MISSED && hit.geometry == number && hit.primitive == 0, "{number}: {hit:?}");
    }
    Ok(())
}

#[test]
fn geometries_may_name_more_vertices_in_all_than_32_bits_count() -> Result<()> {
    const GEOMETRIES: u32 = 4_300;
    let Some(ctx) = software_alone(|_| ()) else { return Ok(()) };
    let shared = Shared::new(&ctx, 1_000_000, GEOMETRIES)?;
    let geometries = shared.geometries(GEOMETRIES, 1);
    for flags in
        [BuildFlags::FAST_BUILD, BuildFlags::FAST_TRACE | BuildFlags::ALLOW_UPDATE, BuildFlags::LOW_MEMORY]
    {
        let mesh = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
        check(&ctx, &TlasInstance::new(*mesh), GEOMETRIES)?;
        let modes = [BuildMode::Rebuild, BuildMode::Refit];
        let count = if flags.contains(BuildFlags::ALLOW_UPDATE) { 2 } else { 1 };
        for mode in &modes[..count] {
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*mesh], *mode)?;
            ctx.submit(cmd)?;
            check(&ctx, &TlasInstance::new(*mesh), GEOMETRIES)?;
        }
    }
    Ok(())
}

/// Leaves that name vertices are no use where these are copied for each geometry.
#[test]
fn low_memory_takes_no_more_than_without_where_geometries_share_vertices() -> Result<()> {
    const GEOMETRIES: u32 = 100;
    const EACH: u32 = 50;
    let Some(ctx) = software_alone(|_| ()) else { return Ok(()) };
    let shared = Shared::new(&ctx, 100_000, GEOMETRIES * EACH)?;
    let geometries = shared.geometries(GEOMETRIES, EACH);
    for more in [BuildFlags::FAST_BUILD, BuildFlags::FAST_TRACE, BuildFlags::ALLOW_UPDATE] {
        let desc = |flags| BlasDesc { geometries: &geometries, flags, ..Default::default() };
        let taken = |flags| -> Result<[u64; 2]> {
            let most = ctx.blas_sizes(&desc(flags))?.structure_bytes;
            let mesh = ctx.create_blas(&desc(flags))?;
            let mut cmd = ctx.acquire_command_buffer()?;
            cmd.build_blas(&[*mesh], BuildMode::Rebuild)?;
            ctx.submit(cmd)?;
            ctx.wait_idle()?;
            Ok([most, ctx.accel_memory().structure_bytes])
        };
        let (low, without) = (taken(more | BuildFlags::LOW_MEMORY)?, taken(more)?);
        assert!(low[0] <= without[0] && low[1] <= without[1], "{more:?}: {low:?}, {without:?}");
    }
    Ok(())
}
