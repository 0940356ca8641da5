//! Lays out a window with text and writes it to `window.ppm`.

use lvk::{
    ColorAttachment, Context, ContextDesc, Format, RenderPassDesc, TextureDesc, TextureRegion, TextureUsage,
};
use lvk_egui::{Painter, Screen};

const SIZE: [u32; 2] = [320, 200];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let (format, usage) = (Format::Rgba8Unorm, TextureUsage::TARGET);
    let target = ctx.create_texture(&TextureDesc { format, extent: SIZE, usage, ..Default::default() })?;
    let (ui, mut painter) = (egui::Context::default(), Painter::new(&ctx, format)?);

    let size = egui::vec2(SIZE[0] as f32, SIZE[1] as f32);
    let screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size));
    // A window has its place from the second frame on.
    for _ in 0..2 {
        let output = ui.run(egui::RawInput { screen_rect, ..Default::default() }, |ui| {
            egui::Window::new("lvk-egui").show(ui, |ui| {
                ui.heading("Painted with lvk");
                ui.label("on any device with Vulkan 1.3");
                ui.add(egui::ProgressBar::new(0.7));
            });
        });
        let primitives = ui.tessellate(output.shapes, output.pixels_per_point);
        let screen = Screen { size_px: SIZE, pixels_per_point: output.pixels_per_point };
        painter.update(&primitives, &output.textures_delta, screen)?;
        let mut cmd = ctx.acquire_command_buffer()?;
        let mut pass = cmd.begin_rendering(&RenderPassDesc {
            color: &[ColorAttachment::clear(*target, [0.1, 0.1, 0.15, 1.0])],
            debug_name: "interface",
            ..Default::default()
        })?;
        painter.record(&mut pass)?;
        drop(pass);
        ctx.submit(cmd)?;
    }
    let rgba = ctx.download_texture(*target, &TextureRegion::default())?;
    let rgb: Vec<_> = rgba.chunks(4).flat_map(|texel| &texel[..3]).copied().collect();
    let header = format!("P6 {} {} 255\n", SIZE[0], SIZE[1]);
    Ok(std::fs::write("window.ppm", [header.as_bytes(), &rgb[..]].concat())?)
}
