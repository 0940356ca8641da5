//! The targets.

use std::path::Path;

use lvk::test_hooks::{outside_bytes, outside_pipelines};
use lvk_samples::app::progress::Progress;
use lvk_samples::picture::{self, Bounds};
use lvk_samples::scene::{ObjOptions, Scene};
use lvk_viewer::light::Environment;

use crate::Target;
use crate::files::with_files;
use crate::gltf::read_gltf;
use crate::input::Input;
use crate::memory::MemoryBound;

const KIB: usize = 1 << 10;

/// All targets, in the order of `docs/reliability.md`.
pub const TARGETS: &[Target] = &[
    Target { name: "obj", memory: MemoryBound { fixed: 2048 * KIB, multiple: 256 }, read: read_obj },
    Target { name: "mtl", memory: MemoryBound { fixed: 2048 * KIB, multiple: 256 }, read: read_mtl },
    Target { name: "cameras", memory: MemoryBound { fixed: 2048 * KIB, multiple: 64 }, read: read_cameras },
    Target { name: "image", memory: MemoryBound { fixed: 256 * KIB, multiple: 16 << 14 }, read: read_image },
    Target {
        name: "environment",
        memory: MemoryBound { fixed: 512 * KIB, multiple: 2304 },
        read: read_environment,
    },
    Target { name: "spirv", memory: MemoryBound { fixed: 1024 * KIB, multiple: 512 }, read: read_spirv },
    Target {
        name: "ray_pipeline",
        memory: MemoryBound { fixed: 4096 * KIB, multiple: 512 },
        read: read_ray_pipeline,
    },
    Target { name: "glsl", memory: MemoryBound { fixed: 512 * KIB, multiple: 8192 }, read: read_glsl },
    Target {
        name: "pipeline_cache",
        memory: MemoryBound { fixed: KIB, multiple: 4 },
        read: read_pipeline_cache,
    },
    Target {
        name: "shader_cache",
        memory: MemoryBound { fixed: 64 * KIB, multiple: 128 },
        read: read_shader_cache,
    },
    Target { name: "blas", memory: MemoryBound { fixed: 16 * KIB, multiple: 32 }, read: read_blas },
    Target { name: "gltf", memory: MemoryBound { fixed: 4096 * KIB, multiple: 128 }, read: read_gltf },
    Target { name: "tree", memory: MemoryBound { fixed: 16 * KIB, multiple: 32 }, read: read_tree },
];

fn load_scene(folder: &Path, options: &ObjOptions) {
    match Scene::from_obj(&folder.join("mesh.obj"), options, &mut Progress::hidden()) {
        Ok(scene) => check_scene(&scene),
        Err(error) => drop(error.to_string()),
    }
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
fn read_obj(bytes: &[u8]) {
    with_files(&[("mesh.obj", bytes)], |folder| load_scene(folder, &ObjOptions::default()));
}

/// An MTL file, which a mesh of one material for each of some names uses.
fn read_mtl(bytes: &[u8]) {
    const MESH: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
        usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 2/1 3/2 4/3\nusemtl c\nf 1/1 2/2 4/3\n";
    /// The smallest BMP: one texel.
    const IMAGE: &[u8] = b"BM\x3a\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x01\0\0\0\x01\0\0\0\x01\0\x18\0\0\0\0\0\
        \x04\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\x10\x20\x30\0";
    let options = ObjOptions { normal_maps: true, ..ObjOptions::default() };
    with_files(&[("mesh.obj", MESH), ("a.mtl", bytes), ("t.bmp", IMAGE)], |folder| {
        load_scene(folder, &options)
    });
}

/// A camera file of a scene.
fn read_cameras(bytes: &[u8]) {
    const MESH: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    with_files(&[("mesh.obj", MESH), ("cameras.txt", bytes)], |folder| {
        load_scene(
            folder,
            &ObjOptions { cameras: Some(folder.join("cameras.txt")), ..ObjOptions::default() },
        );
    });
}

/// An image file. The first byte chooses its name, which decides where the contents do not, and the bounds.
fn read_image(bytes: &[u8]) {
    const NAMES: [&str; 6] = ["a.png", "a.jpg", "a.bmp", "a.tga", "a", "a.gif"];
    let mut input = Input::new(bytes);
    let choice = input.byte();
    let name = NAMES[usize::from(choice & 0x3f) % NAMES.len()];
    let small = Bounds { max_side: 40, max_texels: 1_000, ..Bounds::default() };
    let bounds = if choice & 0x80 == 0 { Bounds::default() } else { small };
    with_files(&[(name, input.rest())], |folder| match picture::read(&folder.join(name), &bounds) {
        Ok(picture) => {
            let texels = picture.width as usize * picture.height as usize;
            assert!(texels > 0 && picture.rgba.len() == 4 * texels);
            assert!(picture.width <= bounds.max_side && picture.height <= bounds.max_side);
        }
        Err(error) => drop(error.to_string()),
    });
}

/// A Radiance HDR file of light from all directions.
fn read_environment(bytes: &[u8]) {
    with_files(&[("sky.hdr", bytes)], |folder| match Environment::from_hdr(&folder.join("sky.hdr"), 90.0) {
        Ok(environment) => {
            let sky = environment.sky;
            assert!(sky.width > 0 && sky.width <= 2048);
            assert_eq!(sky.texels.len(), sky.width as usize * sky.height as usize);
            assert!(sky.texels.iter().flatten().all(|channel| (0.0..=1e8).contains(channel)));
        }
        Err(error) => drop(error.to_string()),
    });
}

/// SPIR-V words. The first four bytes choose the stage, so that words stay aligned.
fn read_spirv(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    input.short();
    input.byte();
    outside_bytes::read_spirv(choice, &input.words());
}

/// SPIR-V words of a shader of a ray tracing pipeline, whose other shaders are intact. The first four bytes choose the place of
/// the shader and the traversal, so that words stay aligned.
fn read_ray_pipeline(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    input.short();
    input.byte();
    outside_pipelines::read_ray_pipeline(choice, &input.words());
}

/// GLSL texts: the module's own, then pairs of the name and the text of a listed include, then a log of the compiler. A NUL
/// byte separates them.
fn read_glsl(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let parts: Vec<&str> = text.split('\0').collect();
    let [own, rest @ ..] = &parts[..] else { return };
    let (pairs, log) = rest.as_chunks::<2>();
    let listed: Vec<(&str, &str)> = pairs.iter().map(|[name, text]| (*name, *text)).collect();
    outside_bytes::read_glsl(own, &listed, log.first().copied().unwrap_or_default());
}

/// A pipeline cache file. A first byte that is odd puts a valid header around the rest.
fn read_pipeline_cache(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    outside_bytes::read_pipeline_cache(input.byte() & 1 == 1, input.rest());
}

/// A file of the shader cache. A first byte that is odd puts a valid header before the rest.
fn read_shader_cache(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    outside_bytes::read_shader_cache(input.byte() & 1 == 1, input.rest());
}

/// A serialised BLAS. A first byte that is odd puts a valid header before the rest.
fn read_blas(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    outside_bytes::read_blas(input.byte() & 1 == 1, input.rest());
}

/// A file of the tree cache. The first byte: bit 0 puts a valid header before the rest, bit 1 is a mesh of AABBs, further bits
/// are the number of geometries. The number of primitives of each geometry follows, two bytes each.
fn read_tree(bytes: &[u8]) {
    let mut input = Input::new(bytes);
    let choice = input.byte();
    let counts: Vec<u32> = (0..choice >> 2 & 3).map(|_| input.short().into()).collect();
    outside_bytes::read_tree(choice & 1 == 1, choice & 2 == 2, &counts, input.rest());
}
