//! The painter of user interfaces: colours, clip rectangles, textures and text are where egui puts them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::Path;

use egui::{Align2, Color32, FontId, LayerId, RawInput, Rect, pos2, vec2};
use image::{Rgba, RgbaImage};
use lvk::{
    ColorAttachment, Context, Dependencies, Format, Holder, RenderPassDesc, TextureDesc, TextureHandle,
    TextureRegion, TextureUsage,
};
use lvk_samples::app::headless;
use lvk_samples::app::hot_reload::reload;
use lvk_samples::app::ui::Painter;
use lvk_samples::hello_triangle::HelloTriangle;
use lvk_samples::shader_folder;
use lvk_tests::device;
use tempfile::TempDir;

use crate::frames::copy_folder;

const SIZE: [u32; 2] = [64, 48];
const GROUND: [u8; 4] = [10, 20, 30, 255];

/// An interface that is painted on a texture of its own.
struct Easel {
    ctx: Context,
    ui: egui::Context,
    painter: Painter,
    target: Holder<TextureHandle>,
}

impl Easel {
    fn new(ctx: &Context, format: Format) -> Self {
        let ui = egui::Context::default();
        ui.tessellation_options_mut(|options| options.feathering = false);
        let mut painter = Painter::new(ctx).unwrap();
        painter.prepare(format).unwrap();
        let usage = TextureUsage::TARGET | TextureUsage::SAMPLED;
        let desc = TextureDesc { format, extent: SIZE, usage, ..TextureDesc::default() };
        Self { ctx: ctx.clone(), ui, painter, target: ctx.create_texture(&desc).unwrap() }
    }

    /// Returns the pixels after `paint` has drawn over the ground.
    fn paint(&mut self, shown: &[TextureHandle], paint: impl Fn(&egui::Painter)) -> RgbaImage {
        self.paint_with(1.0, shown, paint)
    }

    fn paint_with(
        &mut self,
        per_point: f32,
        shown: &[TextureHandle],
        paint: impl Fn(&egui::Painter),
    ) -> RgbaImage {
        let size = vec2(SIZE[0] as f32, SIZE[1] as f32) / per_point;
        let mut input =
            RawInput { screen_rect: Some(Rect::from_min_size(pos2(0.0, 0.0), size)), ..RawInput::default() };
        input.viewports.entry(input.viewport_id).or_default().native_pixels_per_point = Some(per_point);
        let output = self.ui.run(input, |ui| {
            let painter = ui.layer_painter(LayerId::background());
            let [r, g, b, _] = GROUND;
            painter.rect_filled(Rect::EVERYTHING, 0.0, Color32::from_rgb(r, g, b));
            paint(&painter);
        });
        self.painter.upload(&self.ui, output, SIZE).unwrap();
        let mut cmd = self.ctx.acquire_command_buffer().unwrap();
        let mut pass = cmd
            .begin_rendering(&RenderPassDesc {
                color: &[ColorAttachment::clear(*self.target, [1.0; 4])],
                dependencies: Dependencies { sampled_images: shown, ..Dependencies::default() },
                ..RenderPassDesc::default()
            })
            .unwrap();
        self.painter.record(&mut pass).unwrap();
        drop(pass);
        self.ctx.submit(cmd).unwrap();
        let pixels = self.ctx.download_texture(*self.target, &TextureRegion::default()).unwrap();
        RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).unwrap()
    }
}

fn rect(low: [f32; 2], high: [f32; 2]) -> Rect {
    Rect { min: low.into(), max: high.into() }
}

/// Returns the pixels that differ from the ground.
fn touched(picture: &RgbaImage) -> Vec<(u32, u32)> {
    picture.enumerate_pixels().filter(|(.., pixel)| pixel.0 != GROUND).map(|(x, y, _)| (x, y)).collect()
}

fn inside(x: u32, y: u32, [left, top, right, bottom]: [u32; 4]) -> bool {
    (left..right).contains(&x) && (top..bottom).contains(&y)
}

#[test]
fn rectangles_have_their_pixels_and_colours() {
    let Some(ctx) = device() else { return };
    let color = Color32::from_rgb(200, 100, 50);
    for format in [Format::Rgba8Unorm, Format::Rgba8Srgb] {
        let picture = Easel::new(&ctx, format).paint(&[], |painter| {
            painter.rect_filled(rect([5.0, 6.0], [20.0, 16.0]), 0.0, color);
            let clipped = painter.with_clip_rect(rect([30.0, 10.0], [40.0, 20.0]));
            clipped.rect_filled(rect([25.0, 5.0], [60.0, 15.0]), 0.0, color);
        });
        for (x, y, Rgba(found)) in picture.enumerate_pixels() {
            let is_on = inside(x, y, [5, 6, 20, 16]) || inside(x, y, [30, 10, 40, 15]);
            let expected = if is_on { color.to_array() } else { GROUND };
            let near = found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 1);
            assert!(
                near && (format == Format::Rgba8Srgb || *found == expected),
                "{format:?} {x} {y}: {found:?}"
            );
        }
    }
}

#[test]
fn points_are_pixels_as_the_screen_has_them() {
    let Some(ctx) = device() else { return };
    let picture = Easel::new(&ctx, Format::Rgba8Unorm).paint_with(2.0, &[], |painter| {
        painter.rect_filled(rect([3.0, 4.0], [8.0, 10.0]), 0.0, Color32::WHITE);
    });
    let expected: Vec<_> = (0..SIZE[1])
        .flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)))
        .filter(|(x, y)| inside(*x, *y, [6, 8, 16, 20]))
        .collect();
    assert_eq!(touched(&picture), expected);
}

#[test]
fn translucent_shapes_let_the_ground_through() {
    let Some(ctx) = device() else { return };
    let color = Color32::from_rgba_premultiplied(60, 0, 90, 128);
    let picture = Easel::new(&ctx, Format::Rgba8Unorm).paint(&[], |painter| {
        painter.rect_filled(rect([0.0, 0.0], [64.0, 48.0]), 0.0, color);
    });
    let expected = [0, 1, 2].map(|c| f32::from(color.to_array()[c]) + f32::from(GROUND[c]) * (127.0 / 255.0));
    for pixel in picture.pixels() {
        assert!((0..3).all(|c| (f32::from(pixel.0[c]) - expected[c]).abs() <= 1.0), "{pixel:?}");
    }
}

#[test]
fn images_are_named_by_number() {
    let Some(ctx) = device() else { return };
    let pixels: Vec<u8> = (0..8_u8 * 4).flat_map(|i| [8 * i, 255 - 8 * i, i, 255]).collect();
    let (format, data) = (Format::Rgba8Unorm, Some(&pixels[..]));
    let texture =
        ctx.create_texture(&TextureDesc { format, extent: [8, 4], data, ..TextureDesc::default() }).unwrap();
    let whole = rect([0.0, 0.0], [1.0, 1.0]);
    let picture = Easel::new(&ctx, format).paint(&[*texture], |painter| {
        let place = rect([12.0, 10.0], [20.0, 14.0]);
        painter.image(Painter::texture_id(&texture), place, whole, Color32::WHITE);
    });
    for (number, expected) in pixels.chunks_exact(4).enumerate() {
        let (x, y) = (12 + number as u32 % 8, 10 + number as u32 / 8);
        let found = picture.get_pixel(x, y).0;
        assert!(
            found.iter().zip(expected).all(|(a, b)| a.abs_diff(*b) <= 1),
            "{x} {y}: {found:?}, not {expected:?}"
        );
    }
    assert_eq!(touched(&picture).len(), 32);
}

#[test]
fn text_is_at_its_position_and_new_letters_come_to_the_atlas() {
    let Some(ctx) = device() else { return };
    let write = |text: &'static str| {
        move |painter: &egui::Painter| {
            painter.text(pos2(4.0, 8.0), Align2::LEFT_TOP, text, FontId::monospace(16.0), Color32::WHITE);
        }
    };
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    let first = easel.paint(&[], write("Abc"));
    let letters = touched(&first);
    assert!(letters.len() > 60 && letters.len() < 400, "{}", letters.len());
    assert!(letters.iter().all(|(x, y)| inside(*x, *y, [3, 8, 40, 32])), "{letters:?}");
    assert!(first.pixels().any(|pixel| pixel.0[0] > 240), "nothing is white");
    // Letters that the atlas has not seen are updates of a part of it, and the ones before stay.
    let second = easel.paint(&[], write("Wxyz"));
    assert!(second == Easel::new(&ctx, Format::Rgba8Unorm).paint(&[], write("Wxyz")));
    assert!(easel.paint(&[], write("Abc")) == first && first != second);
}

/// A copy of the folder of shaders in which the triangle's and the painter's colours begin with these words.
fn shaders(triangle: &str, painter: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../shaders"), folder.path());
    for (file, before, change) in [
        ("hello_triangle/triangle.frag.glsl", "    result = vec4(", triangle),
        ("app/ui.frag.glsl", "    result = ", painter),
    ] {
        let path = folder.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.matches(before).count(), 1, "`{before}` in {file}");
        fs::write(&path, text.replace(before, &format!("{before}{change}"))).unwrap();
    }
    folder
}

#[test]
fn a_reload_takes_over_the_shaders_of_sample_and_painter_or_neither() {
    let Some(ctx) = device() else { return };
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    let mut sample = HelloTriangle::new(&ctx, SIZE).unwrap();
    let shown = |sample: &mut HelloTriangle, easel: &mut Easel| {
        let painted = easel.paint(&[], |painter| {
            painter.rect_filled(rect([5.0, 6.0], [20.0, 16.0]), 0.0, Color32::WHITE);
        });
        (headless::picture(sample).unwrap(), painted)
    };
    let before = shown(&mut sample, &mut easel);
    for (triangle, painter, wrong) in
        [("1.0 - ", "noSuchValue * ", "ui.frag"), ("noSuchValue * ", "0.5 * ", "triangle.frag")]
    {
        let folder = shaders(triangle, painter);
        let told = shader_folder::with(folder.path(), || reload(&mut sample, &mut easel.painter));
        let told = told.unwrap_err().to_string();
        assert!(told.contains("noSuchValue") && told.contains(wrong), "{told}");
        assert!(shown(&mut sample, &mut easel) == before, "{wrong}: a part is new");
    }
    let folder = shaders("1.0 - ", "0.5 * ");
    shader_folder::with(folder.path(), || reload(&mut sample, &mut easel.painter)).unwrap();
    let after = shown(&mut sample, &mut easel);
    assert!(after.0 != before.0 && after.1 != before.1, "a part is old");
}

#[test]
fn many_triangles_fit_and_textures_are_freed() {
    let Some(ctx) = device() else { return };
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    let image = egui::ColorImage::filled([2, 2], Color32::from_rgb(0, 255, 0));
    let texture = easel.ui.load_texture("green", image, egui::TextureOptions::NEAREST);
    let green = texture.id();
    let paint = move |painter: &egui::Painter| {
        for row in 0..80 {
            for column in 0..80 {
                let low = pos2(0.5 * column as f32, 0.25 * row as f32);
                painter.rect_filled(Rect::from_min_size(low, vec2(0.5, 0.25)), 0.0, Color32::RED);
            }
        }
        painter.image(green, rect([50.0, 30.0], [60.0, 40.0]), rect([0.0, 0.0], [1.0, 1.0]), Color32::WHITE);
    };
    let first = easel.paint(&[], paint);
    assert_eq!(first.get_pixel(20, 10).0, [255, 0, 0, 255]);
    assert_eq!(first.get_pixel(55, 35).0, [0, 255, 0, 255]);
    assert_eq!(touched(&first).len(), 40 * 20 + 100);
    // Given up with this frame, which still shows it.
    let last = std::cell::Cell::new(Some(texture));
    let still = easel.paint(&[], |painter| {
        paint(painter);
        drop(last.take());
    });
    assert!(still == first);
    let gone = easel.paint(&[], |painter| {
        painter.rect_filled(rect([0.0, 0.0], [1.0, 1.0]), 0.0, Color32::RED);
    });
    assert_eq!(touched(&gone), [(0, 0)]);
}
