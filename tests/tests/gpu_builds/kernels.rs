//! All kernels of builds and refits, one after the other.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

use lvk::test_hooks::{build_tlas, check_structure, compile_kernels, place, read, refit};
use lvk_tests::binary_tree::binary_structure;
use lvk_tests::device;
use lvk_tests::gpu_built::{build, check_contents, facts, input, numbered, scattered, triangles};
use lvk_tests::wide_tree::wide_structure;

/// 3 rows, custom index and mask, offset and flags, structure.
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
        let vertices = input(&ctx, &scattered(count, 1));
        let geometries = [triangles(*vertices, count)];
        let built = build(&ctx, &geometries);
        check_contents(&facts(&ctx, &built), &numbered(&scattered(count, 1)));
        let binary = place(&ctx, &binary_structure(count)).unwrap();
        let wide = place(&ctx, &wide_structure(count)).unwrap();
        ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&scattered(count, 2))).unwrap();
        refit(&ctx, &[(&built, &geometries), (&binary, &geometries), (&wide, &geometries)]).unwrap();
        for structure in [&built, &binary, &wide] {
            check_contents(&facts(&ctx, structure), &numbered(&scattered(count, 2)));
        }
        let records: Vec<_> = (0..count).map(|i| record(i as f32, built.address)).collect();
        let records = input(&ctx, &records);
        let tlas = build_tlas(&ctx, *records, count as u32, count as u32, None).unwrap();
        let [lo, hi] = facts(&ctx, &built).bounds;
        let world = |i: u32| [[lo[0] + i as f32, lo[1], lo[2]], [hi[0] + i as f32, hi[1], hi[2]]];
        let words = read(&ctx, &tlas).unwrap();
        let found = check_structure(&words, &world).unwrap_or_else(|what| panic!("{what}"));
        assert_eq!(found.primitives.len(), count);
    }
}
