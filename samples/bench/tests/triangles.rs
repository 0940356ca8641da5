//! Draws the triangles of `bench peers` by `lvk` and by plain `ash`: the pictures are equal.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk_bench::peers::{GlslStage, compile};
use lvk_dev_driver::{DriverRequest, prepare};

#[path = "../examples/triangle_ash.rs"]
mod triangle_ash;
#[path = "../examples/triangle_lvk.rs"]
mod triangle_lvk;

/// Opens the loader, which the programs find by its bare name.
fn open_loader() {
    if let Some(loader) = prepare(&DriverRequest::default()).unwrap().loader {
        // SAFETY: the library is a Vulkan loader.
        std::mem::forget(unsafe { ash::Entry::load_from(loader) }.unwrap());
    }
}

#[test]
fn both_pictures_are_equal() {
    open_loader();
    let ours = triangle_lvk::draw().unwrap();
    assert!(ours == triangle_ash::draw().unwrap());
    let folder = tempfile::tempdir().unwrap();
    std::env::set_current_dir(folder.path()).unwrap();
    triangle_lvk::main().unwrap();
    let by_lvk = std::fs::read("triangle.ppm").unwrap();
    triangle_ash::main().unwrap();
    assert!(by_lvk == std::fs::read("triangle.ppm").unwrap());
    assert_eq!(by_lvk.len(), "P6 256 256 255\n".len() + 3 * 256 * 256);
    let inside = ours.chunks(4).filter(|texel| texel[..3] != [0, 0, 0]).count();
    assert!(
        (19_000..23_000).contains(&inside),
        "the triangle covers 32 % of the picture, not {inside} pixels"
    );
}

#[test]
fn the_shaders_are_those_of_the_sources() {
    let shaders = [(GlslStage::Vertex, "triangle.vert"), (GlslStage::Fragment, "triangle.frag")];
    for (stage, name) in shaders {
        let path = format!("{}/examples/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(format!("{path}.glsl")).unwrap();
        let words = compile(stage, &text).unwrap();
        let bytes: &[u8] = bytemuck::cast_slice(&words);
        if std::env::var_os("LVK_UPDATE_KERNELS").is_some() {
            std::fs::write(format!("{path}.spv"), bytes).unwrap();
        }
        assert!(
            std::fs::read(format!("{path}.spv")).unwrap() == bytes,
            "{name}: LVK_UPDATE_KERNELS=1 writes it"
        );
    }
}
