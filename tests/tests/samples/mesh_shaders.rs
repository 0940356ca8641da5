//! Images of the `mesh_shaders` sample: culled meshlets change no pixel, and task and mesh shaders draw what a vertex
//! shader draws.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use image::RgbaImage;
use lvk::{Context, CullMode, Dependencies, DeviceProfile, RenderPipelineDesc, TextureRegion};
use lvk_samples::app::headless;
use lvk_samples::app::render_target::RenderTarget;
use lvk_samples::app::sample::{FrameTime, Sample};
use lvk_samples::app::sample_error::SampleError;
use lvk_samples::mesh_shaders::MeshShaders;
use lvk_samples::pipelines::SampleStage;
use lvk_samples::raster::RasterPipeline;
use lvk_samples::scene::Camera;
use lvk_tests::image_comparison::{Tolerance, assert_matches_reference, assert_similar};
use lvk_tests::raster_sample::{ROUND, SIZE, assert_refuses_impossible_sizes, image_of};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::{TestDevice, device, device_with};

const SAME_TRIANGLES: Tolerance = Tolerance { psnr: 55.0, ssim: 0.9999, differing_share: 2e-3, flip: 1e-3 };
/// Most corners of a meshlet's triangles.
const MOST_CORNERS: u32 = 3 * 96;

/// Corners of all meshlets, an instance for each, without task and mesh shaders.
const STAGES: [SampleStage; 2] = [
    SampleStage::from_glsl(
        r#"
        #include "mesh_shaders/frame.glsl"
        layout(location = 0) out vec3 position;
        layout(location = 1) out vec3 normal;
        layout(location = 2) flat out uint number;
        void main() {
            Meshlet meshlet = frame.meshlets.at[gl_InstanceIndex];
            uint triangle = min(gl_VertexIndex / 3, meshlet.triangleCount - 1u);
            uint place = frame.triangles.at[meshlet.firstTriangle + triangle] >> (8 * (gl_VertexIndex % 3)) & 255u;
            Vertex corner = frame.vertices.at[frame.vertexNumbers.at[meshlet.firstVertex + place]];
            number = gl_InstanceIndex;
            position = turned(corner.position + movedBy(number));
            normal = turned(corner.normal);
            gl_Position = cameraClip(frame.camera, position);
        }"#,
        "test.vert",
    ),
    SampleStage::from_glsl(
        r#"
        #include "mesh_shaders/frame.glsl"
        #include "mesh_shaders/shade.glsl"
        layout(location = 0) in vec3 position;
        layout(location = 1) in vec3 normal;
        layout(location = 2) flat in uint number;
        layout(location = 0) out vec4 result;
        void main() {
            vec3 toEye = normalize(frame.camera.eye - position);
            result = vec4(lit(meshletColor(number, frame.count), normalize(normal), toEye), 1.0);
        }"#,
        "test.frag",
    ),
];

/// A device with mesh shaders; otherwise the test says that it tests nothing.
fn mesh_device() -> Option<TestDevice> {
    let ctx = device()?;
    let has = ctx.capabilities().mesh_shader;
    if !has {
        eprintln!("NOT TESTED, {} has no mesh shaders", ctx.capabilities().device_name);
    }
    has.then_some(ctx)
}

fn knot(ctx: &Context, culls: bool) -> MeshShaders {
    MeshShaders::new(ctx, SIZE, culls).unwrap()
}

/// Draws, by a vertex shader, the frame that `sample` has drawn last.
fn by_vertex_shader(ctx: &Context, sample: &MeshShaders) -> RgbaImage {
    let target = RenderTarget::with_depth(ctx, SIZE).unwrap();
    let state = RenderPipelineDesc { cull: CullMode::Back, ..RenderPipelineDesc::default() };
    let pipeline = RasterPipeline::with_depth("mesh_shaders", "by vertex shader", &STAGES);
    let pipeline = pipeline.create_with(ctx, &state).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let constants = sample.upload(&mut cmd).unwrap();
    let backdrop = [0.010, 0.012, 0.020];
    let mut pass = target.begin(&mut cmd, "by vertex shader", backdrop, &Dependencies::default()).unwrap();
    pass.bind_render_pipeline(*pipeline).unwrap();
    pass.push_constants(&constants).unwrap();
    pass.draw(0..MOST_CORNERS, 0..sample.meshlets().meshlets.len() as u32).unwrap();
    drop(pass);
    ctx.submit(cmd).unwrap();
    let pixels = ctx.download_texture(target.image(), &TextureRegion::default()).unwrap();
    RgbaImage::from_raw(SIZE[0], SIZE[1], pixels).unwrap()
}

#[test]
fn culled_meshlets_do_not_change_the_image() {
    let Some(ctx) = mesh_device() else { return };
    let (mut all, mut some) = (knot(&ctx, false), knot(&ctx, true));
    let count = all.meshlets().meshlets.len() as u32;
    for frame in [0, 30, 80] {
        assert!(image_of(&mut all, frame) == image_of(&mut some, frame), "frame {frame}");
        let drawn = some.drawn().unwrap();
        assert_eq!(all.drawn(), Some(count));
        assert!(drawn < count - count / 10 && drawn > count / 3, "{drawn} of {count} in frame {frame}");
    }
}

/// Cases: cameras within the knot, beside it, and in front of it.
#[test]
fn meshlets_outside_the_image_are_culled() {
    let Some(ctx) = mesh_device() else { return };
    let (mut all, mut some) = (knot(&ctx, false), knot(&ctx, true));
    let count = all.meshlets().meshlets.len() as u32;
    let behind = Camera::looking_along([0.0, 0.0, 4.0], [0.0, 0.0, 1.0], 50.0);
    for (view, most) in [
        (Camera::looking_at([0.1, 0.0, 0.2], [2.0, 0.3, 0.0], 60.0), count / 3),
        (Camera::looking_at([3.0, 1.0, 3.0], [3.4, 0.0, 0.0], 60.0), count / 2),
        (Camera::looking_at([0.0, 0.5, 2.6], [0.4, 0.0, 0.0], 12.0), count / 4),
        (behind, 0),
    ] {
        let [whole, culled] = [&mut all, &mut some].map(|sample| {
            sample.update(FrameTime::from_frame(10, ROUND));
            sample.set_view(&view);
            headless::picture(sample).unwrap()
        });
        let drawn = some.drawn().unwrap();
        assert!(whole == culled && drawn <= most, "{view:?}: {drawn} of {count}");
    }
}

#[test]
fn a_vertex_shader_draws_the_same() {
    let Some(ctx) = mesh_device() else { return };
    let mut sample = knot(&ctx, true);
    for frame in [0, 55] {
        let image = image_of(&mut sample, frame);
        assert_similar("knot by vertex shader", &by_vertex_shader(&ctx, &sample), &image, &SAME_TRIANGLES);
    }
}

#[test]
fn the_knot_looks_as_it_always_did() {
    let Some(ctx) = mesh_device() else { return };
    assert_matches_reference("mesh_shaders_small", &image_of(&mut knot(&ctx, true), 0));
}

fn assert_missing(ctx: &Context) {
    let refused = MeshShaders::new(ctx, SIZE, true).err();
    let Some(error @ SampleError::Missing { .. }) = refused else { unreachable!("{refused:?}") };
    let text = error.to_string();
    let device = &ctx.capabilities().device_name;
    assert!(text.contains("no mesh shaders") && text.contains(device) && text.contains("--device"), "{text}");
}

#[test]
fn devices_without_mesh_shaders_are_reported() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert_missing(&ctx);
    on_swiftshader(devices_without_mesh_shaders_are_reported, || {
        let Some(ctx) = device() else { return };
        assert_missing(&ctx);
    });
}

#[test]
fn impossible_images_are_refused() {
    let Some(ctx) = mesh_device() else { return };
    assert_refuses_impossible_sizes(|size| MeshShaders::new(&ctx, size, true));
}
