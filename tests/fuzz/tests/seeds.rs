//! Writes the inputs of the corpus that code makes: `cargo test --test seeds -- --ignored`. Other inputs are kept.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageFormat, RgbaImage};
use lvk::test_hooks::{outside_bytes, outside_pipelines};

/// Choices that begin an input of the target `image`: the name of the file, and small bounds.
const PNG: u8 = 0;
const JPEG: u8 = 1;
const BMP: u8 = 2;
const TGA: u8 = 3;
const SMALL: u8 = 0x80;

fn corpus_folder(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target)
}

fn write(target: &str, name: &str, parts: &[&[u8]]) {
    let folder = corpus_folder(target);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(name), parts.concat()).unwrap();
}

#[test]
#[ignore = "writes files"]
fn write_seeds() {
    write_images();
    write_modules("spirv", outside_bytes::example_spirv().unwrap());
    write_modules("ray_pipeline", outside_pipelines::example_ray_pipeline());
    for (number, (is_aabbs, counts, tree)) in outside_bytes::example_trees().into_iter().enumerate() {
        let choice = 1 | u8::from(is_aabbs) << 1 | (counts.len() as u8) << 2;
        let counts: Vec<u8> = counts.iter().flat_map(|count| (*count as u16).to_le_bytes()).collect();
        write("tree", &format!("seed-{number}"), &[&[choice], &counts, &tree]);
        if number == 0 {
            write("tree", "whole-file", &[&[choice & !1], &counts, &outside_bytes::whole_tree_file(&tree)]);
        }
    }
    let blas = outside_bytes::example_blas();
    write("blas", "seed-0", &[&[1], &blas]);
    write("blas", "whole-file", &[&[0], &outside_bytes::whole_blas_file(&blas)]);
    // Vulkan's header, whose vendor, device and UUID are 0.
    let data = [&[32, 0, 0, 0, 1, 0, 0, 0][..], &[0; 24], b"driver data"].concat();
    write("pipeline_cache", "whole-file", &[&[0], &outside_bytes::whole_pipeline_file(&data)]);
    let shader = std::fs::read(corpus_folder("shader_cache").join("seed-0")).unwrap();
    write("shader_cache", "whole-file", &[&[0], &outside_bytes::whole_shader_file(&shader[1..])]);
}

fn write_modules(target: &str, modules: Vec<(u8, Vec<u32>)>) {
    for (number, (choice, words)) in modules.into_iter().enumerate() {
        let words: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        write(target, &format!("seed-{number}"), &[&[choice, 0, 0, 0], &words]);
    }
}

fn write_images() {
    let texel = |x: u32, y: u32| image::Rgba([x as u8 * 5, y as u8 * 5, 99, 255 - x as u8]);
    let image = DynamicImage::from(RgbaImage::from_fn(45, 7, texel));
    let kinds = [
        ("rgba.png", PNG, ImageFormat::Png, image.clone()),
        ("grey16.png", PNG | SMALL, ImageFormat::Png, image.to_luma16().into()),
        ("rgb.jpg", JPEG, ImageFormat::Jpeg, image.to_rgb8().into()),
        ("grey.jpg", JPEG | SMALL, ImageFormat::Jpeg, image.to_luma8().into()),
        ("rgb.bmp", BMP, ImageFormat::Bmp, image.to_rgb8().into()),
        ("rgba.tga", TGA | SMALL, ImageFormat::Tga, image),
    ];
    for (name, choice, format, image) in kinds {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        write("image", name, &[&[choice], bytes.get_ref()]);
    }
}
