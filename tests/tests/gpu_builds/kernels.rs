//! All kernels of builds and refits, in order.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use lvk::test_hooks::{build_tlas, check_structure, compile_kernels, place, read, refit};
use lvk_tests::bvh2::bvh2_blob;
use lvk_tests::bvh8::bvh8_blob;
use lvk_tests::device;
use lvk_tests::gpu_built::{
    build, build_input_buffer, check_and_summarize, check_contents, scattered_triangles, triangle_geometry,
    with_primitive_numbers,
};

/// 3 rows, custom index and mask, offset and flags, acceleration structure.
fn record(x: f32, structure: u64) -> [u32; 16] {
    let rows = [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_bits);
    let mut words = [0; 16];
    words[..12].copy_from_slice(&rows);
    words[12] = 0xff00_0000;
    words[14] = structure as u32;
    words[15] = (structure >> 32) as u32;
    words
}

#[test]
fn every_kernel_compiles_and_builds_or_refits() {
    let Some(ctx) = device() else { return };
    // A driver that dies of a kernel leaves its name behind.
    compile_kernels(&ctx, &mut |name| eprintln!("{name}")).unwrap();
    for count in [100, 5000] {
        let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 1));
        let geometries = [triangle_geometry(*vertices, count)];
        let built = build(&ctx, &geometries);
        check_contents(
            &check_and_summarize(&ctx, &built),
            &with_primitive_numbers(&scattered_triangles(count, 1)),
        );
        let binary = place(&ctx, &bvh2_blob(count)).unwrap();
        let wide = place(&ctx, &bvh8_blob(count)).unwrap();
        ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&scattered_triangles(count, 2))).unwrap();
        refit(&ctx, &[(&built, &geometries), (&binary, &geometries), (&wide, &geometries)]).unwrap();
        for structure in [&built, &binary, &wide] {
            check_contents(
                &check_and_summarize(&ctx, structure),
                &with_primitive_numbers(&scattered_triangles(count, 2)),
            );
        }
        let records: Vec<_> = (0..count).map(|i| record(i as f32, built.address)).collect();
        let records = build_input_buffer(&ctx, &records);
        let tlas = build_tlas(&ctx, *records, count as u32, count as u32, None).unwrap();
        let [lo, hi] = check_and_summarize(&ctx, &built).bounds;
        let world = |i: u32| [[lo[0] + i as f32, lo[1], lo[2]], [hi[0] + i as f32, hi[1], hi[2]]];
        let words = read(&ctx, &tlas).unwrap();
        let found = check_structure(&words, &world).unwrap_or_else(|what| panic!("{what}"));
        assert_eq!(found.primitives.len(), count);
    }
}
