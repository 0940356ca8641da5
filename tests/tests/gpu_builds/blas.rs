//! BLAS builds on the GPU: every primitive once, bounds that fit, heights within the limit.
#![allow(clippy::unwrap_used, reason = "tests")]

use lvk::test_hooks::{EMPTY, GpuBlasDesc, LeafEncoding, build_blas, build_on_threads, check_structure};
use lvk::{
    BlasGeometry, BuildFlags, GeometryFlags, GeometryTransform, IndexFormat, Indices, Triangles, VertexFormat,
};
use lvk_tests::device;
use lvk_tests::gpu_built::{
    aabb_geometry, build, build_input_buffer, check_and_summarize, check_contents, scattered_triangles,
    triangle_geometry, uneven_triangles, with_primitive_numbers,
};

#[test]
fn every_triangle_is_in_one_leaf() {
    let Some(ctx) = device() else { return };
    for count in [0, 1, 2, 3, 4, 5, 24, 25, 100, 2048, 2049, 5000, 30_000] {
        let corners = scattered_triangles(count, 7);
        let vertices = build_input_buffer(&ctx, &corners);
        let found = check_and_summarize(&ctx, &build(&ctx, &[triangle_geometry(*vertices, count)]));
        check_contents(&found, &with_primitive_numbers(&corners));
        let nodes = found.node_count as usize;
        assert!(nodes <= if count > 3 { count / 10 + 2 } else { 0 }, "{nodes} nodes of {count}");
        if count == 0 {
            assert_eq!(found.bounds, EMPTY);
        }
    }
}

#[test]
fn many_accel_structs_are_built_side_by_side() {
    let Some(ctx) = device() else { return };
    let counts = [10, 3000, 0, 700, 5000, 1, 2500];
    let meshes: Vec<_> = counts.iter().map(|count| scattered_triangles(*count, *count as u64)).collect();
    let vertices: Vec<_> = meshes.iter().map(|corners| build_input_buffer(&ctx, corners)).collect();
    let geometries: Vec<_> =
        vertices.iter().zip(counts).map(|(vertices, count)| [triangle_geometry(**vertices, count)]).collect();
    let leaves = LeafEncoding::Corners;
    let desc = |geometries| GpuBlasDesc { geometries, leaves };
    let descs: Vec<_> = geometries.iter().map(|geometries| desc(&geometries[..])).collect();
    for (structure, corners) in build_blas(&ctx, &descs).unwrap().iter().zip(&meshes) {
        check_contents(&check_and_summarize(&ctx, structure), &with_primitive_numbers(corners));
    }
}

#[test]
fn equal_triangles_make_a_low_tree() {
    let Some(ctx) = device() else { return };
    for count in [2000, 6000] {
        let corners = vec![[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, -9.0]]; count];
        let vertices = build_input_buffer(&ctx, &corners);
        let found = check_and_summarize(&ctx, &build(&ctx, &[triangle_geometry(*vertices, count)]));
        check_contents(&found, &with_primitive_numbers(&corners));
        assert!(found.height <= 7, "{}", found.height);
    }
}

/// Returns the number of nodes if all of them are full.
fn full_nodes(count: usize) -> u32 {
    let mut level = count.div_ceil(24);
    let mut all = level;
    while level > 1 {
        level = level.div_ceil(8);
        all += level;
    }
    all as u32
}

#[test]
fn trees_that_leave_nodes_empty_are_packed() {
    let Some(ctx) = device() else { return };
    for side in [4, 8] {
        let corners = uneven_triangles(side);
        let vertices = build_input_buffer(&ctx, &corners);
        let geometries = [triangle_geometry(*vertices, corners.len())];
        for leaves in [LeafEncoding::Corners, LeafEncoding::Indexed, LeafEncoding::Packed] {
            let desc = GpuBlasDesc { geometries: &geometries, leaves };
            let found = check_and_summarize(&ctx, &build_blas(&ctx, &[desc]).unwrap()[0]);
            check_contents(&found, &with_primitive_numbers(&corners));
            assert_eq!(found.node_count, full_nodes(corners.len()));
        }
    }
}

#[test]
fn inactive_triangles_are_left_out() {
    let Some(ctx) = device() else { return };
    for count in [9, 3000] {
        let mut corners = scattered_triangles(count, 3);
        for i in (0..count).step_by(3) {
            corners[i][i % 2][0] = f32::NAN;
        }
        let vertices = build_input_buffer(&ctx, &corners);
        let found = check_and_summarize(&ctx, &build(&ctx, &[triangle_geometry(*vertices, count)]));
        let mut expected = with_primitive_numbers(&corners);
        expected.retain(|(_, corners)| corners.iter().flatten().all(|number| number.is_finite()));
        check_contents(&found, &expected);
        let nothing = build_input_buffer(&ctx, &vec![[[f32::NAN; 3]; 3]; count]);
        assert_eq!(
            check_and_summarize(&ctx, &build(&ctx, &[triangle_geometry(*nothing, count)])).bounds,
            EMPTY
        );
    }
}

#[test]
fn degenerate_triangles_are_kept() {
    let Some(ctx) = device() else { return };
    let corners = [[[1.0; 3]; 3], [[0.0; 3]; 3], [[2.0; 3], [2.0; 3], [3.0; 3]]];
    let vertices = build_input_buffer(&ctx, &corners);
    check_contents(
        &check_and_summarize(&ctx, &build(&ctx, &[triangle_geometry(*vertices, 3)])),
        &with_primitive_numbers(&corners),
    );
}

#[test]
fn aabbs_are_built_around() {
    let Some(ctx) = device() else { return };
    for count in [1, 500, 4000] {
        let corners = scattered_triangles(count, 11);
        let lo = |t: &[[f32; 3]; 3], axis: usize| t[0][axis].min(t[1][axis]).min(t[2][axis]);
        let hi = |t: &[[f32; 3]; 3], axis: usize| t[0][axis].max(t[1][axis]).max(t[2][axis]);
        let mut list: Vec<[[f32; 3]; 2]> = corners
            .iter()
            .map(|t| [std::array::from_fn(|axis| lo(t, axis)), std::array::from_fn(|axis| hi(t, axis))])
            .collect();
        if count > 10 {
            list[7][0][0] = f32::NAN;
        }
        let buffer = build_input_buffer(&ctx, &list);
        let found = check_and_summarize(&ctx, &build(&ctx, &[aabb_geometry(*buffer, count)]));
        let expected: Vec<_> = (0..)
            .zip(&list)
            .filter(|(_, corners)| !corners[0][0].is_nan())
            .map(|(index, corners)| ((0, index), corners.to_vec()))
            .collect();
        check_contents(&found, &expected);
    }
}

/// Three vertices in a format, as bytes, and what they are as floats.
fn formats() -> Vec<(VertexFormat, Vec<u8>, [[f32; 3]; 3])> {
    fn bytes<T: bytemuck::NoUninit>(data: &[T]) -> Vec<u8> {
        bytemuck::cast_slice(data).to_vec()
    }
    let half = |n: i32| [0xc000_u16, 0xbc00, 0, 0x3c00, 0x4000][(n + 2) as usize];
    let n = i16::MAX;
    vec![
        (VertexFormat::F32, bytes(&[1.0_f32, 2.0, 3.0]), [[1., 0., 0.], [2., 0., 0.], [3., 0., 0.]]),
        (
            VertexFormat::F32x2,
            bytes(&[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0]),
            [[1., 2., 0.], [3., 4., 0.], [5., 6., 0.]],
        ),
        (
            VertexFormat::F32x3,
            bytes(&[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
            [[1., 2., 3.], [4., 5., 6.], [7., 8., 9.]],
        ),
        (
            VertexFormat::F32x4,
            bytes(&[1.0_f32, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0, 0.0, 7.0, 8.0, 9.0, 0.0]),
            [[1., 2., 3.], [4., 5., 6.], [7., 8., 9.]],
        ),
        (
            VertexFormat::F16x2,
            bytes(&[half(1), half(2), half(-1), half(0), half(0), half(-2)]),
            [[1., 2., 0.], [-1., 0., 0.], [0., -2., 0.]],
        ),
        (
            VertexFormat::F16x4,
            bytes(&[
                half(1),
                half(2),
                half(-2),
                half(0),
                half(-1),
                half(0),
                half(1),
                half(0),
                half(0),
                half(-2),
                half(2),
                half(0),
            ]),
            [[1., 2., -2.], [-1., 0., 1.], [0., -2., 2.]],
        ),
        (VertexFormat::Snorm16x2, bytes(&[n, -n, 0, n, -n, 0]), [[1., -1., 0.], [0., 1., 0.], [-1., 0., 0.]]),
        (
            VertexFormat::Snorm16x4,
            bytes(&[n, -n, n, 0, 0, n, -n, 0, -n, 0, n, 0]),
            [[1., -1., 1.], [0., 1., -1.], [-1., 0., 1.]],
        ),
        (
            VertexFormat::Unorm8x4,
            vec![255, 0, 255, 0, 0, 255, 0, 0, 255, 255, 255, 0],
            [[1., 0., 1.], [0., 1., 0.], [1., 1., 1.]],
        ),
        (VertexFormat::U32, bytes(&[1_u32, 2, 3]), [[1., 0., 0.], [2., 0., 0.], [3., 0., 0.]]),
    ]
}

#[test]
fn all_formats_strides_indices_and_matrices_are_read() {
    let Some(ctx) = device() else { return };
    let matrix = build_input_buffer(&ctx, &[0.0_f32, 2.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, -3.0]);
    let moved = |p: [f32; 3]| [2.0 * p[1] + 1.0, p[0], 4.0 * p[2] - 3.0];
    for (format, data, corners) in formats() {
        for (index, extra) in [(None, 0), (Some(IndexFormat::U16), 0), (Some(IndexFormat::U32), 2), (None, 6)]
        {
            let unit = data.len() / 3;
            let extra = if format.size_bytes() > 4 && !format!("{format:?}").starts_with('F') {
                extra
            } else {
                extra / 2 * 4
            };
            // The first bytes are skipped, and so are those between vertices.
            let skipped = extra;
            let mut bytes = vec![0xff_u8; skipped];
            for vertex in data.chunks(unit) {
                bytes.extend_from_slice(vertex);
                bytes.resize(bytes.len() + extra, 0xff);
            }
            let vertices = build_input_buffer(&ctx, &bytes);
            let short = build_input_buffer(&ctx, &[9_u16, 2, 0, 1, 1, 1, 1]);
            let long = build_input_buffer(&ctx, &[9_u32, 2, 0, 1, 1, 1, 1]);
            let indices = index.map(|format| Indices {
                buffer: if format == IndexFormat::U16 { *short } else { *long },
                offset: u64::from(format.size_bytes()),
                format,
            });
            let geometry = Triangles {
                vertex_offset: skipped as u64,
                vertex_stride: (unit + extra) as u64,
                vertex_format: format,
                triangle_count: if index.is_some() { 2 } else { 1 },
                indices,
                transform: Some(GeometryTransform::Buffer { buffer: *matrix, offset: 0 }),
                flags: GeometryFlags::OPAQUE,
                ..Triangles::packed(*vertices, 3)
            };
            let found = check_and_summarize(&ctx, &build(&ctx, &[BlasGeometry::Triangles(geometry)]));
            let [a, b, c] = corners.map(moved);
            let expected = match index {
                None => vec![((0, 0), vec![a, b, c])],
                Some(_) => vec![((0, 0), vec![c, a, b]), ((0, 1), vec![b, b, b])],
            };
            check_contents(&found, &expected);
        }
    }
}

#[test]
fn indices_beyond_the_vertices_make_inactive_triangles() {
    let Some(ctx) = device() else { return };
    let vertices = build_input_buffer(&ctx, &scattered_triangles(1, 1));
    let indices = build_input_buffer(&ctx, &[0_u32, 1, 2, 0, 1, 3, u32::MAX, 0, 0]);
    let geometry = BlasGeometry::Triangles(Triangles::indexed(*vertices, 3, *indices, 3));
    check_contents(
        &check_and_summarize(&ctx, &build(&ctx, &[geometry])),
        &with_primitive_numbers(&scattered_triangles(1, 1)),
    );
}

#[test]
fn several_geometries_keep_their_numbers() {
    let Some(ctx) = device() else { return };
    for scale in [1, 40] {
        let counts = [0, 30, 0, 0, 17, 100, 0].map(|count| count * scale);
        let meshes: Vec<_> = counts.iter().map(|count| scattered_triangles(*count, *count as u64)).collect();
        let vertices: Vec<_> = meshes.iter().map(|corners| build_input_buffer(&ctx, corners)).collect();
        let geometries: Vec<_> = vertices
            .iter()
            .zip(counts)
            .map(|(vertices, count)| triangle_geometry(**vertices, count))
            .collect();
        let mut expected = Vec::new();
        for (geometry, mesh) in (0..).zip(&meshes) {
            expected.extend(
                with_primitive_numbers(mesh).into_iter().map(|((_, index), c)| ((geometry, index), c)),
            );
        }
        for leaves in [LeafEncoding::Corners, LeafEncoding::Indexed, LeafEncoding::Packed] {
            let desc = GpuBlasDesc { geometries: &geometries, leaves };
            let built = build_blas(&ctx, &[desc]).unwrap();
            check_contents(&check_and_summarize(&ctx, &built[0]), &expected);
        }
    }
}

#[test]
fn trees_cost_rays_little_more_than_those_of_the_cpu() {
    let Some(ctx) = device() else { return };
    // A few long triangles among many small ones are what a space-filling curve is bad at.
    let mut corners = scattered_triangles(4000, 21);
    corners.iter_mut().step_by(16).for_each(|triangle| triangle[1] = triangle[1].map(|n| n * 0.5));
    let vertices = build_input_buffer(&ctx, &corners);
    let built = build(&ctx, &[triangle_geometry(*vertices, corners.len())]);
    let found = check_and_summarize(&ctx, &built);
    let found = found.cost;
    let triangles: Vec<[u32; 3]> =
        (0..corners.len() as u32).map(|first| [0, 1, 2].map(|at| first * 3 + at)).collect();
    let mut expected = 0.0;
    build_on_threads(corners.as_flattened(), &triangles, BuildFlags::FAST_TRACE, 2, 1, |of_cpu| {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&of_cpu.bytes);
        expected = check_structure(&words, &|_| EMPTY).unwrap().cost;
    });
    assert!(found < expected * 1.15, "{found} {expected}");
}
