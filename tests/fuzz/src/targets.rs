//! The targets.

use std::path::Path;

use lvk::test_hooks::{outside_bytes, outside_pipelines};
use lvk_samples::app::progress::Progress;
use lvk_samples::scene::{ObjOptions, Scene};
use lvk_viewer::light::Environment;

use crate::Target;
use crate::files::with_files;
use crate::gltf::read_gltf;
use crate::input::Input;
use crate::memory::MemoryBound;
use crate::picture::{decoded_image_bytes, read_image};

const KIB: usize = 1 << 10;
const MIB: usize = 1 << 20;

/// All targets, in the order of `docs/reliability.md`.
pub const TARGETS: &[Target] = &[
    target("obj", bound(512 * KIB, 160, 6 * MIB), read_obj),
    target("mtl", bound(512 * KIB, 160, 6 * MIB), read_mtl),
    target("cameras", bound(512 * KIB, 24, 2 * MIB), read_cameras),
    Target {
        name: "image",
        memory: MemoryBound { fixed: 512 * KIB, per_byte: 16, per_decoded: 2, most: 24 * MIB },
        decoded: decoded_image_bytes,
        read: read_image,
    },
    target("environment", bound(512 * KIB, 2_176, 26 * MIB), read_environment),
    target("spirv", bound(256 * KIB, 192, 7 * MIB), read_spirv),
    target("ray_pipeline", bound(2048 * KIB, 192, 8 * MIB), read_ray_pipeline),
    target("glsl", bound(512 * KIB, 4_608, 8 * MIB), read_glsl),
    target("pipeline_cache", bound(KIB, 2, 96 * KIB), read_pipeline_cache),
    target("shader_cache", bound(16 * KIB, 96, 4 * MIB), read_shader_cache),
    target("blas", bound(16 * KIB, 4, 192 * KIB), read_blas),
    target("gltf", bound(1536 * KIB, 48, 3 * MIB), read_gltf),
    target("tree", bound(16 * KIB, 4, 192 * KIB), read_tree),
];

/// A target whose inputs state no size of their contents.
const fn target(name: &'static str, memory: MemoryBound, read: fn(&[u8]) -> bool) -> Target {
    Target { name, memory, decoded: |_| 0, read }
}

const fn bound(fixed: usize, per_byte: usize, most: usize) -> MemoryBound {
    MemoryBound { fixed, per_byte, per_decoded: 0, most }
}

/// Reads a scene, and checks it. True if it loads.
fn load_scene(folder: &Path, options: &ObjOptions) -> bool {
    let scene = Scene::from_obj(&folder.join("mesh.obj"), options, &mut Progress::hidden());
    match &scene {
        Ok(scene) => check_scene(scene),
        Err(error) => drop(error.to_string()),
    }
    scene.is_ok()
}

/// Checks what renderers rely on.
fn check_scene(scene: &Scene) {
    let vertex_count = scene.positions.len();
    assert!(scene.normals.len() == vertex_count && scene.texcoords.len() == vertex_count);
    assert!(scene.triangles.iter().flatten().all(|vertex| (*vertex as usize) < vertex_count));
    assert_eq!(scene.triangle_materials.len(), scene.triangles.len());
    assert!(scene.triangle_materials.iter().all(|material| (*material as usize) < scene.materials.len()));
    assert!(scene.positions.iter().flatten().all(|x| x.is_finite()));
    let textures = scene.textures.len() as u32;
    assert!(
        scene.materials.iter().filter_map(|material| material.albedo_texture).all(|used| used < textures)
    );
}

/// An OBJ file. Libraries and images that it names are not there.
fn read_obj(bytes: &[u8]) -> bool {
    with_files(&[("mesh.obj", bytes)], |folder| load_scene(folder, &ObjOptions::default()))
}

/// An MTL file, which a mesh of one material for each of some names uses.
fn read_mtl(bytes: &[u8]) -> bool {
    const MESH: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
        usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 2/1 3/2 4/3\nusemtl c\nf 1/1 2/2 4/3\n";
    /// The smallest BMP: one texel.
    const IMAGE: &[u8] = b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\x18\0\0\0\0\0\
        \x04\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x10\x20\x30\0";
    // With fewer cameras, most of the time goes into a search for views, which depends on the mesh alone.
    const CAMERAS: &[u8] = b"scene mesh 1 2 3\nat 0 0 5 0 0 0 60\nat 0 0 4 0 0 0 60\nat 0 0 3 0 0 0 60\n\
        at 0 0 2 0 0 0 60\nat 0 0 1 0 0 0 60\n";
    let files = [("mesh.obj", MESH), ("a.mtl", bytes), ("t.bmp", IMAGE), ("cameras.txt", CAMERAS)];
    with_files(&files, |folder| {
        let cameras = Some(folder.join("cameras.txt"));
        load_scene(folder, &ObjOptions { normal_maps: true, cameras, ..ObjOptions::default() })
    })
}

/// A camera file of a scene.
fn read_cameras(bytes: &[u8]) -> bool {
    const MESH: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    with_files(&[("mesh.obj", MESH), ("cameras.txt", bytes)], |folder| {
        let cameras = Some(folder.join("cameras.txt"));
        load_scene(folder, &ObjOptions { cameras, ..ObjOptions::default() })
    })
}

/// A Radiance HDR file of light from all directions.
fn read_environment(bytes: &[u8]) -> bool {
    with_files(&[("sky.hdr", bytes)], |folder| match Environment::from_hdr(&folder.join("sky.hdr"), 90.0) {
        Ok(environment) => {
            let sky = environment.sky;
            assert!(sky.width > 0 && sky.width <= 2048);
            assert_eq!(sky.texels.len(), sky.width as usize * sky.height as usize);
            assert!(sky.texels.iter().flatten().all(|channel| (0.0..=1e8).contains(channel)));
            true
        }
        Err(error) => error.to_string().is_empty(),
    })
}

/// SPIR-V words. The first four bytes choose the stage, so that words stay aligned.
fn read_spirv(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    input.short();
    input.byte();
    outside_bytes::read_spirv(choice, &input.words())
}

/// SPIR-V words of a shader of a ray tracing pipeline, whose other shaders are intact. The first four bytes choose the place of
/// the shader and the traversal, so that words stay aligned.
fn read_ray_pipeline(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    input.short();
    input.byte();
    outside_pipelines::read_ray_pipeline(choice, &input.words())
}

/// GLSL texts: the module's own, then pairs of the name and the text of a listed include, then a log of the compiler. A NUL
/// byte separates them.
fn read_glsl(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let parts: Vec<&str> = text.split('\0').collect();
    let [own, rest @ ..] = &parts[..] else { return false };
    let (pairs, log) = rest.as_chunks::<2>();
    let listed: Vec<(&str, &str)> = pairs.iter().map(|[name, text]| (*name, *text)).collect();
    outside_bytes::read_glsl(own, &listed, log.first().copied().unwrap_or_default())
}

/// A pipeline cache file. A first byte that is odd puts a valid header around the rest.
fn read_pipeline_cache(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    outside_bytes::read_pipeline_cache(input.byte() & 1 == 1, input.rest())
}

/// A file of the shader cache. A first byte that is odd puts a valid header before the rest.
fn read_shader_cache(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    outside_bytes::read_shader_cache(input.byte() & 1 == 1, input.rest())
}

/// A serialised BLAS. A first byte that is odd puts a valid header before the rest.
fn read_blas(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    outside_bytes::read_blas(input.byte() & 1 == 1, input.rest())
}

/// A file of the tree cache. The first byte: bit 0 puts a valid header before the rest, bit 1 is a mesh of AABBs, further bits
/// are the number of geometries. The number of primitives of each geometry follows, two bytes each.
fn read_tree(bytes: &[u8]) -> bool {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    let counts: Vec<u32> = (0..choice >> 2 & 3).map(|_| input.short().into()).collect();
    outside_bytes::read_tree(choice & 1 == 1, choice & 2 == 2, &counts, input.rest())
}
