//! Refits on the GPU of trees built by the CPU or the GPU: the tree keeps its nodes, and its bounds equal those of a
//! new fit.
#![allow(clippy::unwrap_used, reason = "tests")]

use lvk::test_hooks::{EMPTY, GpuBlasDesc, LeafEncoding, build_blas, place, read, refit};
use lvk::{
    BlasDesc, BlasGeometry, BuildFlags, Context, Dependencies, DeviceProfile, RayQueryRequest, Result,
};
use lvk_tests::bvh2::bvh2_blob;
use lvk_tests::bvh8::bvh8_blob;
use lvk_tests::compute::{compute_pipeline, read_words, words_buffer};
use lvk_tests::gpu_built::{
    aabb_geometry, build, build_input_buffer, check_and_summarize, check_contents, scattered_triangles,
    triangle_geometry, with_primitive_numbers,
};
use lvk_tests::meshes::Mesh;
use lvk_tests::ray_scene::{Layout, Part, PartBuffers, upload_geometries, vertex_bytes};
use lvk_tests::vertex_deform::deformed;
use lvk_tests::{device, device_with};

#[test]
fn trees_of_the_gpu_follow_moved_triangles() {
    let Some(ctx) = device() else { return };
    for count in [0, 1, 2, 3, 1000, 20_000] {
        for leaves in [LeafEncoding::Corners, LeafEncoding::Indexed, LeafEncoding::Packed] {
            let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 1));
            let geometries = [triangle_geometry(*vertices, count)];
            let desc = GpuBlasDesc { geometries: &geometries, leaves };
            let structure = build_blas(&ctx, &[desc]).unwrap().remove(0);
            let before = check_and_summarize(&ctx, &structure);
            for seed in [2, 3] {
                let moved = scattered_triangles(count, seed);
                if count > 0 {
                    ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&moved)).unwrap();
                }
                refit(&ctx, &[(&structure, &geometries)]).unwrap();
                let after = check_and_summarize(&ctx, &structure);
                assert_eq!(after.primitives, before.primitives);
                assert_eq!(after.height, before.height);
                check_contents(&after, &with_primitive_numbers(&moved));
            }
        }
    }
}

/// Collapsed ones are encoded by the kernel that refits them, from AABBs that came another way.
#[test]
fn a_refit_of_what_did_not_move_changes_nothing() {
    let Some(ctx) = device() else { return };
    for count in [1, 3, 4, 30, 2000, 5000] {
        let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 6));
        let geometries = [triangle_geometry(*vertices, count)];
        let structure = build(&ctx, &geometries);
        let words = read(&ctx, &structure).unwrap();
        refit(&ctx, &[(&structure, &geometries)]).unwrap();
        assert!(read(&ctx, &structure).unwrap() == words, "{count}");
    }
}

#[test]
fn aabbs_follow_too() {
    let Some(ctx) = device() else { return };
    let count = 3000;
    let list = |shift: f32| -> Vec<[[f32; 3]; 2]> {
        scattered_triangles(count, 5)
            .iter()
            .map(|t| [t[0].map(|n| n + shift), t[0].map(|n| n + shift + 2.0)])
            .collect()
    };
    let buffer = build_input_buffer(&ctx, &list(0.0));
    let geometries = [aabb_geometry(*buffer, count)];
    let structure = build(&ctx, &geometries);
    ctx.upload_buffer(*buffer, 0, bytemuck::cast_slice(&list(50.0))).unwrap();
    refit(&ctx, &[(&structure, &geometries)]).unwrap();
    let expected: Vec<_> =
        (0..).zip(list(50.0)).map(|(index, corners)| ((0, index), corners.to_vec())).collect();
    check_contents(&check_and_summarize(&ctx, &structure), &expected);
}

#[test]
fn triangles_that_are_lost_are_in_no_aabb() {
    let Some(ctx) = device() else { return };
    let count = 100;
    let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 1));
    let geometries = [triangle_geometry(*vertices, count)];
    let structure = build(&ctx, &geometries);
    ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&vec![[[f32::NAN; 3]; 3]; count])).unwrap();
    refit(&ctx, &[(&structure, &geometries)]).unwrap();
    assert_eq!(check_and_summarize(&ctx, &structure).bounds, EMPTY);
}

/// A node without primitives has the AABB of [`EMPTY`], which rays in every direction miss, so that they visit no
/// child of it.
#[test]
fn no_ray_enters_an_empty_aabb() {
    let Some(ctx) = device_with(|desc| desc.ray_query = RayQueryRequest::Software) else { return };
    let pipeline = compute_pipeline(
        &ctx,
        "#include <lvk/ray_query.glsl>
         layout(local_size_x = 27) in;
         layout(buffer_reference, scalar) writeonly buffer Entered { uint at[]; };
         layout(push_constant, scalar) uniform Push { Entered entered; };
         void main() {
             uint i = gl_LocalInvocationIndex;
             vec3 direction = vec3(uvec3(i, i / 3u, i / 9u) % 3u) - 1.0;
             LvkSoftSlabs ray = lvkSoftSlabsOf(vec3(0.5), direction, LVK_SOFT_LEAST);
             vec2 none = lvkSoftCross(ray, vec3(3.4e38), vec3(-3.4e38), vec2(0.0, 1e30),
                                      lvkSoftTouchSlack(ray, vec3(3.4e38), vec3(-3.4e38)));
             vec2 around = lvkSoftCross(ray, vec3(0.0), vec3(1.0), vec2(0.0, 1e30),
                                        lvkSoftTouchSlack(ray, vec3(0.0), vec3(1.0)));
             entered.at[i] = uint(none.x <= none.y) + 2u * uint(around.x <= around.y);
         }",
    );
    let entered = words_buffer(&ctx, &[9; 27]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*entered).unwrap()).unwrap();
    cmd.dispatch([1; 3], &Dependencies { buffers: &[*entered], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *entered, 27), [2; 27]);
}

/// Refits blobs of `blob(count)` to triangles that have moved.
fn follow_moved_triangles(counts: &[usize], blob: fn(usize) -> Vec<u32>) {
    let Some(ctx) = device() else { return };
    for &count in counts {
        let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 1));
        let geometries = [triangle_geometry(*vertices, count)];
        let structure = place(&ctx, &blob(count)).unwrap();
        for seed in [1, 4] {
            let moved = scattered_triangles(count, seed);
            ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&moved)).unwrap();
            refit(&ctx, &[(&structure, &geometries)]).unwrap();
            check_contents(&check_and_summarize(&ctx, &structure), &with_primitive_numbers(&moved));
        }
    }
}

#[test]
fn binary_nodes_follow_moved_triangles() {
    follow_moved_triangles(&[1, 3, 4, 7, 200, 5000], bvh2_blob);
}

#[test]
fn wide_nodes_follow_moved_triangles() {
    follow_moved_triangles(&[1, 3, 4, 24, 25, 200, 5000], bvh8_blob);
}

/// The words of a tree that the CPU built of a mesh, and its input.
fn tree_of_the_cpu(
    ctx: &Context,
    mesh: &Mesh,
    flags: BuildFlags,
) -> Result<(Vec<u32>, Vec<PartBuffers>, Vec<BlasGeometry>)> {
    const MARK: &[u8] = b"lvk software structure, form 3\0\0";
    let parts = [Part::new(mesh.clone(), Layout::Indexed16)];
    let (buffers, geometries) = upload_geometries(ctx, &parts)?;
    let blas = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() })?;
    let bytes = ctx.serialize_blas(*blas)?;
    let start = bytes.windows(MARK.len()).position(|window| window == MARK).unwrap() + MARK.len();
    let words = bytes[start..].as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
    Ok((words, buffers, geometries))
}

/// Cases: leaves that share vertices, and others.
#[test]
fn trees_of_the_cpu_follow_moved_triangles() {
    let profile = DeviceProfile::no_ray_tracing();
    let bare = device_with(|desc| {
        desc.profile = Some(&profile);
        desc.ray_query = RayQueryRequest::Software;
    });
    let Some(ctx) = bare else { return };
    for mesh in [Mesh::torus(1), Mesh::cube_grid(1), Mesh::terrain(40)] {
        for (flags, leaf_kind) in [(BuildFlags::FAST_TRACE, 0), (BuildFlags::LOW_MEMORY, 4)] {
            let flags = flags | BuildFlags::ALLOW_UPDATE;
            let (words, buffers, geometries) = tree_of_the_cpu(&ctx, &mesh, flags).unwrap();
            assert_eq!(words[1], leaf_kind, "{flags:?}");
            let structure = place(&ctx, &words).unwrap();
            for amount in [0.0, 0.8] {
                let moved = deformed(&mesh, amount);
                let bytes = vertex_bytes(&moved, Layout::Indexed16);
                ctx.upload_buffer(*buffers[0].vertices, 0, &bytes).unwrap();
                refit(&ctx, &[(&structure, &geometries)]).unwrap();
                let corners = |named: &[u32; 3]| named.map(|vertex| moved.positions[vertex as usize]);
                let expected: Vec<_> = moved.triangles.iter().map(corners).collect();
                check_contents(&check_and_summarize(&ctx, &structure), &with_primitive_numbers(&expected));
            }
        }
    }
}

/// Scattered triangles of which every third lies far out, every sixth with one corner only, on all six sides.
fn partly_far(count: usize, reach: f32) -> Vec<[[f32; 3]; 3]> {
    let mut triangles = scattered_triangles(count, 1);
    for number in (0..count).step_by(3) {
        let corners = if number % 2 == 0 { 1 } else { 3 };
        for corner in &mut triangles[number][..corners] {
            corner[number / 6 % 3] = if number % 4 < 2 { reach } else { -reach };
        }
    }
    triangles
}

#[test]
fn aabbs_of_what_lies_far_out_end_as_those_of_the_cpu_do() {
    let Some(ctx) = device() else { return };
    for count in [1, 4, 25, 2000] {
        let vertices = build_input_buffer(&ctx, &scattered_triangles(count, 1));
        let geometries = [triangle_geometry(*vertices, count)];
        let built = build(&ctx, &geometries);
        let binary = place(&ctx, &bvh2_blob(count)).unwrap();
        let wide = place(&ctx, &bvh8_blob(count)).unwrap();
        for reach in [1e14, 1e16, 1e30, 3e38, 0.0] {
            let moved = partly_far(count, reach);
            ctx.upload_buffer(*vertices, 0, bytemuck::cast_slice(&moved)).unwrap();
            refit(&ctx, &[(&built, &geometries), (&binary, &geometries), (&wide, &geometries)]).unwrap();
            for structure in [&built, &binary, &wide, &build(&ctx, &geometries)] {
                check_contents(&check_and_summarize(&ctx, structure), &with_primitive_numbers(&moved));
            }
        }
    }
}

/// AABBs themselves end there, as those that the CPU reads do.
#[test]
fn aabbs_far_out_end_too() {
    let Some(ctx) = device() else { return };
    let count = 200;
    let list = |reach: f32| -> Vec<[[f32; 3]; 2]> {
        scattered_triangles(count, 5).iter().map(|t| [t[0], t[0].map(|n| n.abs() + reach)]).collect()
    };
    let buffer = build_input_buffer(&ctx, &list(1.0));
    let geometries = [aabb_geometry(*buffer, count)];
    let structure = build(&ctx, &geometries);
    for reach in [1e16, 3e38, f32::INFINITY] {
        ctx.upload_buffer(*buffer, 0, bytemuck::cast_slice(&list(reach))).unwrap();
        refit(&ctx, &[(&structure, &geometries)]).unwrap();
        let ended = list(reach).into_iter().map(|[low, _]| vec![low, [1e15; 3]]);
        let expected: Vec<_> = (0..).zip(ended).map(|(index, corners)| ((0, index), corners)).collect();
        check_contents(&check_and_summarize(&ctx, &structure), &expected);
    }
}

#[test]
fn accel_structs_are_refitted_side_by_side() {
    let Some(ctx) = device() else { return };
    let counts = [50, 3000, 900, 400];
    let vertices: Vec<_> =
        counts.iter().map(|count| build_input_buffer(&ctx, &scattered_triangles(*count, 1))).collect();
    let geometries: Vec<_> =
        vertices.iter().zip(counts).map(|(vertices, count)| [triangle_geometry(**vertices, count)]).collect();
    let mut structures: Vec<_> = geometries[..2].iter().map(|geometries| build(&ctx, geometries)).collect();
    structures.push(place(&ctx, &bvh8_blob(counts[2])).unwrap());
    structures.push(place(&ctx, &bvh2_blob(counts[3])).unwrap());
    for (vertices, count) in vertices.iter().zip(counts) {
        ctx.upload_buffer(**vertices, 0, bytemuck::cast_slice(&scattered_triangles(count, 9))).unwrap();
    }
    let refits: Vec<_> = structures.iter().zip(&geometries).map(|(s, g)| (s, &g[..])).collect();
    refit(&ctx, &refits).unwrap();
    for (structure, count) in structures.iter().zip(counts) {
        check_contents(
            &check_and_summarize(&ctx, structure),
            &with_primitive_numbers(&scattered_triangles(count, 9)),
        );
    }
}
