//! Images: PNG, JPEG, WebP and KTX2.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::io::Cursor;
use std::sync::Arc;

use image::{ExtendedColorType, ImageEncoder as _, ImageFormat};
use lvk_gltf::{ColorSpace, ImageData, Model, Problem, TexelFormat};
use serde_json::json;

use crate::glb::Glb;

/// Returns a PNG of these texels.
pub fn png(width: u32, height: u32, rgba: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    encoder.write_image(rgba, width, height, ExtendedColorType::Rgba8).unwrap();
    bytes
}

/// A KTX2 file of one or more mip levels, the largest first.
fn ktx2(vk_format: u32, scheme: u32, [width, height]: [u32; 2], levels: &[(&[u8], u64)]) -> Vec<u8> {
    let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>();
    let index_end = 80 + 24 * levels.len() as u32;
    // A basic descriptor without samples; the loader goes by the format.
    let descriptor = words(&[28, 0, 2 | 24 << 16, 1 | 1 << 8 | 1 << 16, 0, 0, 0]);
    let mut file = ktx2::MAGIC.to_vec();
    file.extend(words(&[vk_format, 1, width, height, 0, 0, 1, levels.len() as u32, scheme]));
    file.extend(words(&[index_end, 28, 0, 0, 0, 0, 0, 0]));
    let mut offset = u64::from(index_end) + 28;
    for (data, size) in levels {
        file.extend([offset, data.len() as u64, *size].iter().flat_map(|number| number.to_le_bytes()));
        offset += data.len() as u64;
    }
    file.extend(descriptor);
    levels.iter().for_each(|(data, _)| file.extend(*data));
    file
}

/// A file whose material uses an image as base colour.
fn with_image(bytes: &[u8]) -> Glb {
    let mut glb = Glb::triangle();
    let view = glb.view(bytes);
    glb.push("images", json!({ "bufferView": view, "name": "Wood" }));
    glb.push("textures", json!({ "source": 0 }));
    glb.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    glb
}

fn decoded(bytes: &[u8]) -> Arc<ImageData> {
    with_image(bytes).load_cleanly().images.remove(0).data
}

const TEXELS: [u8; 24] =
    [255, 0, 0, 255, 0, 255, 0, 128, 0, 0, 255, 0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100, 110, 120];

#[test]
fn png_is_decoded_to_rgba() {
    let image = decoded(&png(3, 2, &TEXELS));
    assert_eq!(
        (image.format, image.extent(), &image.mips[0].bytes[..]),
        (TexelFormat::Rgba8, [3, 2], &TEXELS[..])
    );
    // Grey with 16 bits, without alpha.
    let mut bytes = Vec::new();
    let grey = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(2, 1, vec![0_u16, 0xabcd]).unwrap();
    grey.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).unwrap();
    assert_eq!(decoded(&bytes).mips[0].bytes, [0, 0, 0, 255, 0xab, 0xab, 0xab, 255]);
}

#[test]
fn webp_without_loss_is_decoded_to_rgba() {
    let mut bytes = Vec::new();
    let encoder = image::codecs::webp::WebPEncoder::new_lossless(&mut bytes);
    encoder.encode(&TEXELS, 3, 2, ExtendedColorType::Rgba8).unwrap();
    assert_eq!(decoded(&bytes).mips[0].bytes, TEXELS);
    // As the image of the extension, beside a PNG for others.
    let mut glb = with_image(&png(1, 1, &[1, 2, 3, 4]));
    let view = glb.view(&bytes);
    glb.push("images", json!({ "bufferView": view, "mimeType": "image/webp" }));
    glb.at("/textures/0")["extensions"] = json!({ "EXT_texture_webp": { "source": 1 } });
    glb.uses("EXT_texture_webp");
    let model = glb.load_cleanly();
    assert_eq!((model.images.len(), model.images[0].source), (1, 1));
    assert_eq!(model.images[0].data.mips[0].bytes, TEXELS);
}

/// WebP with loss: 16 x 16 texels, the upper half red and the lower one blue.
const LOSSY_WEBP: &[u8] =
    b"RIFF<\x00\x00\x00WEBPVP8 0\x00\x00\x00\x90\x01\x00\x9d\x01*\x10\x00\x10\x00\x02\x80B%\
    \xa0\x02t\xba\x00\x03\x98\x00\xfe\xef/\xff\xf9\xb7\xff\xad\xafo\xfe\x09?t\xff\xfe\xb8\
    \x0f\xfep\x18\xc3\xeb\x00\x00\x00";

#[test]
fn webp_with_loss_is_decoded_to_rgba() {
    let image = decoded(LOSSY_WEBP);
    assert_eq!(image.extent(), [16, 16]);
    let texels: Vec<_> = image.mips[0].bytes.chunks(4).collect();
    // Away from the border, which the format blurs.
    for (at, colour) in [(0, [220, 40, 30, 255]), (255, [20, 60, 200, 255])] {
        let is_near = texels[at].iter().zip(colour).all(|(found, wanted)| found.abs_diff(wanted) <= 12);
        assert!(is_near, "{at}: {:?}", texels[at]);
    }
}

#[test]
fn jpeg_is_decoded_and_a_cut_off_one_is_warned_of() {
    let mut bytes = Vec::new();
    let texels = [200, 100, 50].repeat(64 * 64);
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 95)
        .encode(&texels, 64, 64, ExtendedColorType::Rgb8)
        .unwrap();
    let image = decoded(&bytes);
    assert_eq!(image.extent(), [64, 64]);
    for texel in image.mips[0].bytes.chunks(4) {
        assert!(
            texel.iter().zip([200, 100, 50, 255]).all(|(found, wanted)| found.abs_diff(wanted) <= 4),
            "{texel:?}"
        );
    }
    let glb = with_image(&bytes[..bytes.len() - 30]);
    match crate::glb::load(&glb.to_glb()) {
        Ok(model) => assert!(
            model.warnings[0].to_string().contains("image 0 'Wood': corrected a JPEG that is cut off")
        ),
        Err(problem) => assert!(matches!(problem, Problem::Image { .. })),
    }
}

#[test]
fn ktx2_is_read_with_its_mips() {
    const RGBA8: u32 = 37;
    const RGB8: u32 = 23;
    const BC7: u32 = 145;
    const ASTC_6X5: u32 = 163;
    let level = |size: u8| (0..size).collect::<Vec<u8>>();
    let (first, second) = (level(24), level(4));
    let image = decoded(&ktx2(RGBA8, 0, [3, 2], &[(&first, 24), (&second, 4)]));
    assert_eq!(image.format, TexelFormat::Rgba8);
    let levels: Vec<_> = image.mips.iter().map(|mip| (mip.width, mip.height, &mip.bytes)).collect();
    assert_eq!(levels, [(3, 2, &first), (1, 1, &second)]);

    let image = decoded(&ktx2(RGB8, 0, [2, 1], &[(&[1, 2, 3, 4, 5, 6], 6)]));
    assert_eq!(image.mips[0].bytes, [1, 2, 3, 255, 4, 5, 6, 255]);
    let image = decoded(&ktx2(BC7, 0, [5, 4], &[(&level(32), 32)]));
    assert_eq!((image.format, image.mips[0].bytes.len(), image.extent()), (TexelFormat::Bc7, 32, [5, 4]));
    let image = decoded(&ktx2(ASTC_6X5, 0, [7, 5], &[(&level(32), 32)]));
    assert_eq!(image.format, TexelFormat::Astc([6, 5]));
}

#[test]
fn ktx2_with_zstandard_is_unpacked() {
    // A frame of one raw block and one block that repeats a byte.
    let frame = [
        &[0x28, 0xb5, 0x2f, 0xfd, 0x20, 24][..],
        &[(8_u8 << 3), 0, 0],
        &[1, 2, 3, 4, 5, 6, 7, 8],
        &[((16_u8 & 0x1f) << 3) | 0b011, 0, 0],
        &[9],
    ]
    .concat();
    let wanted = [&[1, 2, 3, 4, 5, 6, 7, 8][..], &[9; 16]].concat();
    let image = decoded(&ktx2(37, 2, [3, 2], &[(&frame, 24)]));
    assert_eq!(image.mips[0].bytes, wanted);
    let mut damaged = frame.clone();
    damaged[0] = 0;
    for data in [&frame[..frame.len() - 1], &damaged] {
        assert!(matches!(with_image(&ktx2(37, 2, [3, 2], &[(data, 24)])).problem(), Problem::Image { .. }));
    }
    // A level that unpacks to more than its size.
    with_image(&ktx2(37, 2, [5, 1], &[(&frame, 20)]))
        .expect_problem(&["has not the size that its format demands"]);
}

#[test]
fn images_that_cannot_be_read_are_refused_by_name() {
    let mut cube = ktx2(37, 0, [1, 1], &[(&[0; 24], 24)]);
    cube[36] = 6;
    for (bytes, part) in [
        (&b"BM not an image"[..], "neither PNG, JPEG, WebP nor KTX2"),
        (&png(3, 2, &TEXELS)[..50], "cannot be decoded"),
        (&ktx2(0, 1, [4, 4], &[(&[0; 16], 16)]), "Basis Universal"),
        (&ktx2(97, 0, [1, 1], &[(&[0; 8], 8)]), "R16G16B16A16_SFLOAT, which is not read"),
        (&ktx2(37, 3, [1, 1], &[(&[0; 4], 4)]), "ZLIB"),
        (&ktx2(37, 0, [1, 1], &[(&[0; 8], 8)]), "not the size"),
        (&ktx2(37, 0, [1, 1], &[(&[0; 4], 4), (&[0; 4], 4)]), "2 mip levels, more than 1"),
        (&ktx2(37, 0, [0, 1], &[(&[0; 4], 4)]), "KTX2 is damaged (zero pixel width)"),
        (&cube, "no image in two dimensions"),
        (&ktx2(37, 0, [1, 1], &[(&[0; 4], 4)])[..100], "KTX2 is cut off"),
    ] {
        let problem = with_image(bytes).expect_problem(&["image 0 'Wood': ", part]);
        assert!(matches!(problem, Problem::Image { .. }));
    }
    with_image(&ktx2(37, 0, [40_000, 1], &[(&[0; 4], 4)])).expect_problem(&["at most 32768 a side"]);
}

#[test]
fn absurd_sizes_are_refused_before_anything_is_allocated() {
    let mut bytes = png(3, 2, &TEXELS);
    bytes[16..24].copy_from_slice(&[0, 0, 0x70, 0, 0, 0, 0x70, 0]);
    let header = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&header.to_be_bytes());
    let problem = with_image(&bytes).expect_problem(&["image 0 'Wood'"]);
    assert!(matches!(problem, Problem::Memory { .. }), "{problem}");
}

fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, byte: &u8| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 },
        )
    };
    !bytes.iter().fold(u32::MAX, step)
}

#[test]
fn an_image_that_is_colour_and_data_is_listed_twice_and_decoded_once() {
    let mut glb = with_image(&png(3, 2, &TEXELS));
    glb.at("/materials/0")["normalTexture"] = json!({ "index": 0 });
    glb.at("/materials/0")["emissiveTexture"] = json!({ "index": 0 });
    glb.push("images", json!({ "uri": "not-used.png" }));
    let model: Model = glb.load_cleanly();
    let spaces: Vec<_> = model.images.iter().map(|image| (image.source, image.color_space)).collect();
    assert_eq!(spaces, [(0, ColorSpace::Srgb), (0, ColorSpace::Linear)]);
    assert!(Arc::ptr_eq(&model.images[0].data, &model.images[1].data));
    assert_eq!(model.images[0].name.as_deref(), Some("Wood"));
}

#[test]
fn a_texture_falls_back_to_its_plain_image_and_else_is_left_out() {
    let mut glb = with_image(&png(3, 2, &TEXELS));
    glb.at("/textures/0")["extensions"] = json!({ "KHR_texture_basisu": { "source": 7 } });
    assert_eq!(glb.load().images[0].data.mips[0].bytes, TEXELS);
    assert_eq!(
        glb.warnings(),
        ["texture 0: KHR_texture_basisu is ignored, as the texture has another image"]
    );
    let mut dds = with_image(&png(3, 2, &TEXELS));
    *dds.at("/textures/0") = json!({ "extensions": { "MSFT_texture_dds": { "source": 0 } } });
    let model = dds.load();
    assert!(model.images.is_empty() && model.materials[0].base_color_texture.is_none());
    assert_eq!(
        dds.warnings(),
        ["material 0, texture 0: left out, as it has no image in a format that is read"]
    );
    let mut outside = with_image(&png(3, 2, &TEXELS));
    *outside.at("/textures/0") = json!({ "extensions": { "EXT_texture_webp": { "source": 7 } } });
    outside.expect_problem(&["texture 0: image 7 is out of range, as there are 1"]);
}

#[test]
fn images_lie_in_files_and_in_data_uris() {
    let bytes = png(3, 2, &TEXELS);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("textures")).unwrap();
    std::fs::write(folder.path().join("textures/wood.png"), &bytes).unwrap();
    let mut glb = with_image(&[]);
    *glb.at("/images/0") = json!({ "uri": "textures/wood.png" });
    let path = folder.path().join("model.glb");
    std::fs::write(&path, glb.to_glb()).unwrap();
    let model = Model::load(&path, &lvk_gltf::LoadOptions::default()).unwrap();
    assert_eq!(model.images[0].data.mips[0].bytes, TEXELS);
    let data: String = bytes.iter().map(|byte| format!("%{byte:02X}")).collect();
    *glb.at("/images/0") = json!({ "uri": format!("data:image/png,{data}") });
    assert_eq!(glb.load_cleanly().images[0].data.mips[0].bytes, TEXELS);
    *glb.at("/images/0") = json!({});
    glb.expect_problem(&["image 0", "neither a URI nor a buffer view"]);
}
