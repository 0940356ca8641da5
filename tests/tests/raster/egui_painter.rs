//! The crate `lvk-egui`: colours, clip rectangles, textures and text are where egui puts them.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use egui::{Align2, Color32, FontId, LayerId, RawInput, Rect, pos2, vec2};
use image::{Rgba, RgbaImage};
use lvk::{
    ColorAttachment, Context, Dependencies, Format, Holder, RenderPassDesc, RenderPipelineDesc, TextureDesc,
    TextureHandle, TextureRegion, TextureUsage,
};
use lvk_egui::{Callback, Error, Painter, Screen, Target, TexelEncoding, UserTexture};
use lvk_tests::device;
use lvk_tests::raster::{COVER, PAINT, render_pipeline};

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
        let painter = Painter::new(ctx, format).unwrap();
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
        let primitives = self.ui.tessellate(output.shapes, output.pixels_per_point);
        let screen = Screen { size_px: SIZE, pixels_per_point: output.pixels_per_point };
        self.painter.update(&primitives, &output.textures_delta, screen).unwrap();
        assert_eq!(self.painter.user_textures(), shown);
        self.record()
    }

    /// Returns the pixels after the painter has drawn what it was told last.
    fn record(&mut self) -> RgbaImage {
        let shown = self.painter.user_textures();
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
fn textures_of_the_application_are_painted_by_their_handle() {
    let Some(ctx) = device() else { return };
    let pixels: Vec<u8> = (0..8_u8 * 4).flat_map(|i| [8 * i, 255 - 8 * i, i, 255]).collect();
    let (format, data) = (Format::Rgba8Unorm, Some(&pixels[..]));
    let texture =
        ctx.create_texture(&TextureDesc { format, extent: [8, 4], data, ..TextureDesc::default() }).unwrap();
    let whole = rect([0.0, 0.0], [1.0, 1.0]);
    let mut easel = Easel::new(&ctx, format);
    let user = UserTexture { options: egui::TextureOptions::NEAREST, ..UserTexture::default() };
    let id = easel.painter.register_texture(*texture, &user).unwrap();
    let picture = easel.paint(&[*texture], |painter| {
        let place = rect([12.0, 10.0], [20.0, 14.0]);
        painter.image(id, place, whole, Color32::WHITE);
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

/// One texel of a colour that the application holds as linear light has the same pixels as its encoded form.
#[test]
fn linear_textures_are_encoded_before_they_are_blended() {
    let Some(ctx) = device() else { return };
    let texel = [200, 100, 50, 255];
    let texture = |format| {
        let data = Some(&texel[..]);
        ctx.create_texture(&TextureDesc { format, extent: [1, 1], data, ..TextureDesc::default() }).unwrap()
    };
    for target in [Format::Rgba8Unorm, Format::Rgba8Srgb] {
        let mut easel = Easel::new(&ctx, target);
        for (format, encoding) in
            [(Format::Rgba8Unorm, TexelEncoding::Srgb), (Format::Rgba8Srgb, TexelEncoding::Linear)]
        {
            let texture = texture(format);
            let user = UserTexture { encoding, ..UserTexture::default() };
            let id = easel.painter.register_texture(*texture, &user).unwrap();
            let picture = easel.paint(&[*texture], |painter| {
                let whole = rect([0.0, 0.0], [1.0, 1.0]);
                painter.image(id, rect([0.0, 0.0], [64.0, 48.0]), whole, Color32::WHITE);
            });
            let found = picture.get_pixel(30, 20).0;
            let near = found.iter().zip(texel).all(|(a, b)| a.abs_diff(b) <= 1);
            assert!(near, "{format:?} on {target:?}: {found:?}");
        }
    }
}

#[test]
fn ids_of_no_texture_are_errors_that_name_them() {
    let Some(ctx) = device() else { return };
    let texture = ctx.create_texture(&TextureDesc { extent: [1, 1], ..TextureDesc::default() }).unwrap();
    let mut painter = Painter::new(&ctx, Format::Rgba8Unorm).unwrap();
    let id = painter.register_texture(*texture, &UserTexture::default()).unwrap();
    painter.unregister_texture(id).unwrap();
    let unknown = |answer: Result<(), Error>| {
        assert!(matches!(&answer, Err(Error::UnknownTexture { .. })), "{answer:?}");
        assert!(answer.unwrap_err().to_string().contains("register_texture"));
    };
    unknown(painter.unregister_texture(id));
    unknown(painter.unregister_texture(egui::TextureId::Managed(0)));
    let (mut mesh, whole) = (egui::Mesh::with_texture(id), rect([0.0, 0.0], [1.0, 1.0]));
    mesh.add_rect_with_uv(rect([0.0, 0.0], [9.0, 9.0]), whole, Color32::WHITE);
    let clipped = egui::ClippedPrimitive {
        clip_rect: Rect::EVERYTHING,
        primitive: egui::epaint::Primitive::Mesh(mesh),
    };
    let screen = Screen { size_px: SIZE, pixels_per_point: 1.0 };
    unknown(painter.update(&[clipped], &egui::TexturesDelta::default(), screen));
    let part = egui::epaint::ImageDelta::partial(
        [0, 0],
        egui::ColorImage::filled([1, 1], Color32::WHITE),
        egui::TextureOptions::LINEAR,
    );
    let delta = egui::TexturesDelta { set: vec![(egui::TextureId::Managed(7), part)], free: Vec::new() };
    unknown(painter.update(&[], &delta, screen));
    drop(texture);
    let stale = ctx.create_texture(&TextureDesc { extent: [1, 1], ..TextureDesc::default() }).unwrap();
    let handle = *stale;
    drop(stale);
    let answer = painter.register_texture(handle, &UserTexture::default());
    assert!(matches!(answer, Err(Error::Lvk(lvk::Error::StaleHandle { .. }))), "{answer:?}");
}

#[test]
fn screens_and_targets_that_do_not_fit_are_errors() {
    let Some(ctx) = device() else { return };
    let answer = Painter::new(&ctx, Format::R32Uint).err();
    assert!(matches!(answer, Some(Error::UnsupportedTarget { format: Format::R32Uint })), "{answer:?}");
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    let mut mesh = egui::Mesh::default();
    mesh.add_colored_rect(rect([0.0, 0.0], [9.0, 9.0]), Color32::WHITE);
    easel.paint(&[], |_| {});
    let clipped = [egui::ClippedPrimitive {
        clip_rect: Rect::EVERYTHING,
        primitive: egui::epaint::Primitive::Mesh(mesh),
    }];
    let delta = egui::TexturesDelta::default();
    for pixels_per_point in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let answer = easel.painter.update(&clipped, &delta, Screen { size_px: SIZE, pixels_per_point });
        assert!(matches!(answer, Err(Error::InvalidScale { .. })), "{answer:?}");
    }
    easel.painter.update(&clipped, &delta, Screen { size_px: [8, 8], pixels_per_point: 1.0 }).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let color = &[ColorAttachment::clear(*easel.target, [0.0; 4])];
    let mut pass = cmd.begin_rendering(&RenderPassDesc { color, ..RenderPassDesc::default() }).unwrap();
    let answer = easel.painter.record(&mut pass);
    assert!(matches!(answer, Err(Error::WrongExtent { size_px: [8, 8], extent: SIZE })), "{answer:?}");
    // A pass with other targets is an error of the library, until the painter is told.
    easel.painter.update(&clipped, &delta, Screen { size_px: SIZE, pixels_per_point: 1.0 }).unwrap();
    easel.painter.set_target(Format::Rgba16Float).unwrap();
    assert!(matches!(easel.painter.record(&mut pass), Err(Error::Lvk(lvk::Error::InvalidUsage { .. }))));
    easel.painter.set_target(Format::Rgba8Unorm).unwrap();
    easel.painter.record(&mut pass).unwrap();
}

#[test]
fn passes_with_depth_and_samples_take_an_interface() {
    let Some(ctx) = device() else { return };
    let usage = TextureUsage::TARGET;
    let texture = |format, samples| {
        let desc = TextureDesc { format, extent: SIZE, usage, samples, ..TextureDesc::default() };
        ctx.create_texture(&desc).unwrap()
    };
    let (color, depth) = (texture(Format::Rgba8Unorm, 4), texture(Format::D32Float, 4));
    let target = Target { color: Format::Rgba8Unorm, depth: Some(Format::D32Float), samples: 4 };
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    easel.painter.set_target(target).unwrap();
    let mut mesh = egui::Mesh::default();
    mesh.add_colored_rect(rect([0.0, 0.0], [9.0, 9.0]), Color32::RED);
    let (clip_rect, primitive) = (Rect::EVERYTHING, egui::epaint::Primitive::Mesh(mesh));
    let output = easel.ui.run(RawInput::default(), |_| {});
    let screen = Screen { size_px: SIZE, pixels_per_point: 1.0 };
    let clipped = [egui::ClippedPrimitive { clip_rect, primitive }];
    easel.painter.update(&clipped, &output.textures_delta, screen).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let mut target = ColorAttachment::clear(*color, [0.0, 0.0, 1.0, 1.0]);
    target.resolve = Some(lvk::Resolve { texture: *easel.target, mip: 0, layer: 0 });
    let desc = RenderPassDesc {
        color: &[target],
        depth: Some(lvk::DepthAttachment::clear(*depth, 0.0)),
        ..RenderPassDesc::default()
    };
    let mut pass = cmd.begin_rendering(&desc).unwrap();
    easel.painter.record(&mut pass).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    let pixels = ctx.download_texture(*easel.target, &TextureRegion::default()).unwrap();
    let picture = RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).unwrap();
    assert_eq!([picture.get_pixel(4, 4).0, picture.get_pixel(40, 4).0], [[255, 0, 0, 255], [0, 0, 255, 255]]);
}

/// The application fills the rectangle of its callback; what egui paints before and after lies below and above it.
#[test]
fn callbacks_draw_inside_of_their_rectangle_between_shapes() {
    let Some(ctx) = device() else { return };
    let desc = RenderPipelineDesc { color: &[Format::Rgba8Unorm.into()], ..RenderPipelineDesc::default() };
    let pipeline = std::sync::Arc::new(render_pipeline(&ctx, COVER, PAINT, &desc));
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    let shown = std::sync::Arc::clone(&pipeline);
    let picture = easel.paint(&[], move |painter| {
        painter.rect_filled(rect([8.0, 8.0], [20.0, 20.0]), 0.0, Color32::RED);
        let pipeline = std::sync::Arc::clone(&shown);
        painter.add(Callback::shape(rect([10.0, 10.0], [30.0, 30.0]), move |info, pass| {
            assert_eq!(info.screen_size_px, SIZE);
            pass.bind_render_pipeline(**pipeline)?;
            pass.push_constants(&[0.0_f32, 1.0, 0.0, 1.0, 0.0])?;
            pass.draw(0..3, 0..1)
        }));
        painter.rect_filled(rect([25.0, 25.0], [40.0, 40.0]), 0.0, Color32::BLUE);
    });
    for (x, y, Rgba(found)) in picture.enumerate_pixels() {
        let expected = if inside(x, y, [25, 25, 40, 40]) {
            [0, 0, 255, 255]
        } else if inside(x, y, [10, 10, 30, 30]) {
            [0, 255, 0, 255]
        } else if inside(x, y, [8, 8, 20, 20]) {
            [255, 0, 0, 255]
        } else {
            GROUND
        };
        assert_eq!(*found, expected, "{x} {y}");
    }
}

/// More vertices than 16-bit indices reach, and more bytes than a staging page.
#[test]
fn huge_meshes_are_drawn_whole() {
    let Some(ctx) = device() else { return };
    let mut easel = Easel::new(&ctx, Format::Rgba8Unorm);
    easel.paint(&[], |_| {});
    let mut mesh = egui::Mesh::default();
    for _ in 0..250_000 {
        mesh.add_colored_rect(rect([0.0, 0.0], [1.0, 1.0]), Color32::RED);
    }
    mesh.add_colored_rect(rect([50.0, 40.0], [52.0, 41.0]), Color32::BLUE);
    assert_eq!(mesh.vertices.len(), 1_000_004);
    let (clip_rect, primitive) = (Rect::EVERYTHING, egui::epaint::Primitive::Mesh(mesh));
    let clipped = [egui::ClippedPrimitive { clip_rect, primitive }];
    let screen = Screen { size_px: SIZE, pixels_per_point: 1.0 };
    easel.painter.update(&clipped, &egui::TexturesDelta::default(), screen).unwrap();
    let picture = easel.record();
    assert_eq!(picture.get_pixel(0, 0).0, [255, 0, 0, 255]);
    assert_eq!([50, 51].map(|x| picture.get_pixel(x, 40).0), [[0, 0, 255, 255]; 2]);
    let white = picture.pixels().filter(|pixel| pixel.0 == [255; 4]).count();
    assert_eq!(white, (SIZE[0] * SIZE[1]) as usize - 3);
}
