//! Meshes whose software BVHs tests build on the GPU, and the contents that the BVHs must have.
#![expect(clippy::expect_used, clippy::panic, reason = "a test whose set-up fails has failed")]

use lvk::test_hooks::{
    GpuBlasDesc, GpuStructure, LeafEncoding, StructureFacts, build_blas, check_structure, read,
};
use lvk::{
    Aabbs, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, Context, GeometryFlags, Holder, Triangles,
};

use crate::random::Random;

/// Geometry number, primitive number, and vertices.
pub type Content = ((u32, u32), Vec<[f32; 3]>);

/// Creates a buffer that builds read.
pub fn build_input_buffer<T: bytemuck::NoUninit>(ctx: &Context, data: &[T]) -> Holder<BufferHandle> {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let device = ctx.capabilities();
    let traces = device.ray_tracing_pipeline || device.ray_query;
    let accel = if traces { BufferUsage::ACCEL_INPUT } else { BufferUsage::empty() };
    let desc = BufferDesc {
        size_bytes: bytes.len().max(16) as u64,
        data: Some(bytes),
        usage: BufferUsage::STORAGE | accel,
        debug_name: "input",
        ..Default::default()
    };
    ctx.create_buffer(&desc).expect("a buffer can be made")
}

/// Returns the vertices of small triangles at random positions, equal for equal seeds.
pub fn scattered_triangles(count: usize, seed: u64) -> Vec<[[f32; 3]; 3]> {
    let mut random = Random::new(seed);
    let mut point = |reach: f32| [(); 3].map(|()| random.between(-reach, reach));
    let mut triangle = || {
        let middle = point(100.0);
        [(); 3].map(|()| {
            let offset = point(1.0);
            std::array::from_fn(|axis| middle[axis] + offset[axis])
        })
    };
    (0..count).map(|_| triangle()).collect()
}

/// Returns triangles whose Morton codes give a chain: each level of the tree splits off one triangle. BVH8 nodes of
/// such a tree have only eight triangles, for which the node pool has no memory.
pub fn uneven_triangles(side: u16) -> Vec<[[f32; 3]; 3]> {
    const LONG: u16 = 24;
    const SIZE: f32 = 0.25;
    let mut triangles = Vec::new();
    for place in 0..side.pow(3) {
        let cell = [place % side, place / side % side, place / side / side].map(f32::from);
        for step in 0..LONG {
            let mut corner = cell;
            corner[usize::from(step % 3)] += 0.5_f32.powi(i32::from(step / 3) + 1);
            let [x, y, z] = corner;
            triangles.push([corner, [x + SIZE, y, z], [x, y + SIZE, z + SIZE]]);
        }
    }
    triangles
}

/// Returns a geometry of triangles without indices.
pub fn triangle_geometry(vertices: BufferHandle, count: usize) -> BlasGeometry {
    BlasGeometry::Triangles(Triangles::packed(vertices, count as u32 * 3))
}

/// Returns a geometry of AABBs.
pub fn aabb_geometry(buffer: BufferHandle, count: usize) -> BlasGeometry {
    let flags = GeometryFlags::default();
    BlasGeometry::Aabbs(Aabbs { buffer, offset: 0, stride: 0, count: count as u32, flags })
}

/// Builds one BLAS on the GPU.
pub fn build(ctx: &Context, geometries: &[BlasGeometry]) -> GpuStructure {
    let desc = GpuBlasDesc { geometries, leaves: LeafEncoding::Corners };
    build_blas(ctx, &[desc]).expect("the build is recorded").remove(0)
}

/// Validates a BLAS and returns a summary of its contents.
///
/// # Panics
/// When it is invalid, or higher than planned.
pub fn check_and_summarize(ctx: &Context, structure: &GpuStructure) -> StructureFacts {
    let words = read(ctx, structure).expect("the structure can be read");
    let facts =
        check_structure(&words, &|_| panic!("no instances here")).unwrap_or_else(|what| panic!("{what}"));
    assert!(facts.height <= structure.most_height, "{} nodes high", facts.height);
    facts
}

/// Asserts that the BLAS holds these primitives, each once, with these vertices.
///
/// # Panics
/// When it does not.
pub fn check_contents(facts: &StructureFacts, expected: &[Content]) {
    let bits = |corners: &[[f32; 3]]| corners.iter().map(|c| c.map(f32::to_bits)).collect::<Vec<_>>();
    let mut found: Vec<_> =
        facts.primitives.iter().zip(&facts.vertices).map(|(ids, corners)| (*ids, bits(corners))).collect();
    found.sort_unstable();
    let mut wanted: Vec<_> = expected.iter().map(|(ids, corners)| (*ids, bits(corners))).collect();
    wanted.sort_unstable();
    assert_eq!(found.len(), wanted.len(), "primitives");
    for (found, wanted) in found.iter().zip(&wanted) {
        assert_eq!(found, wanted);
    }
}

/// Returns the triangles of geometry 0 as [`check_contents`] expects them.
pub fn with_primitive_numbers(triangles: &[[[f32; 3]; 3]]) -> Vec<Content> {
    (0..).zip(triangles).map(|(index, corners)| ((0, index), corners.to_vec())).collect()
}
