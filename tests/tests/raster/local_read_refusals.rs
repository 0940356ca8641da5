//! Fragment shaders that read input attachments of their own pass: errors of modules, pipelines, passes and textures,
//! and of devices without local reads.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ColorAttachment, CompareOp, Dependencies, DepthAttachment, DepthState, DeviceProfile, Error, Format,
    OptionalFeature, RenderPassDesc, RenderPipelineDesc, ShaderStage, TextureDesc, TextureKind,
    TextureMemory, TextureUsage,
};
use lvk_tests::local_read::{READ, SIZE, color_pipeline, depth_test, input};
use lvk_tests::raster::{has, run_pass, target, unsupported, usage_error};
use lvk_tests::{device, device_with};

const READS_FIRST: &str = "
    LVK_INPUT(0, subpassInput, gFirst);
    layout(location = 0) out vec4 result;
    void main() { result = subpassLoad(gFirst); }";

#[test]
fn modules_that_read_nothing_of_the_pass_are_refused() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let refused = |declaration: &str, words: &str| {
        let text = format!(
            "{declaration}
             layout(location = 0) out vec4 result;
             void main() {{ result = subpassLoad(gIn); }}"
        );
        let source = lvk::ShaderSource::Glsl(&text);
        let stage = ShaderStage::Fragment;
        let desc = lvk::ShaderModuleDesc { stage, source, debug_name: "reads", ..Default::default() };
        match ctx.create_shader_module(&desc) {
            Err(Error::Shader { name, log }) => {
                assert!(name == "reads" && log.contains(words) && log.contains("'gIn'"), "{name}: {log}");
            }
            other => unreachable!("{words}: {other:?}"),
        }
    };
    let wrong_place = "declare it with LVK_INPUT, LVK_DEPTH_INPUT or LVK_STENCIL_INPUT";
    refused(
        "layout(input_attachment_index = 0, set = 0, binding = 1) uniform subpassInput gIn;",
        wrong_place,
    );
    refused(
        "layout(input_attachment_index = 2, set = 1, binding = 1) uniform subpassInput gIn;",
        wrong_place,
    );
    refused(
        "layout(input_attachment_index = 11, set = 1, binding = 12) uniform subpassInput gIn;",
        wrong_place,
    );
    let sampled =
        "layout(set = 1, binding = 1) uniform sampler2D gIn;\n#define subpassLoad(x) texture(x, vec2(0))";
    refused(sampled, "set 1, binding 1");
}

#[test]
fn pipelines_have_what_their_shaders_read() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let formats = [Format::Rgba8Unorm.into(), Format::R32Uint.into()];
    let plain = RenderPipelineDesc { color: &formats, debug_name: "reader", ..Default::default() };
    let refused = |declaration: &str, desc: &RenderPipelineDesc<'_>, words: &str| {
        let load = if declaration.contains("MS") { "subpassLoad(gIn, 0)" } else { "subpassLoad(gIn)" };
        let text = format!(
            "{declaration} layout(location = 0) out vec4 result; void main() {{ result = vec4({load}); }}"
        );
        let made = color_pipeline(&ctx, &text, desc);
        usage_error(made.map(drop), words);
    };
    let at = |target: u32, ty: &str| format!("LVK_INPUT({target}, {ty}, gIn);");
    refused(
        &at(2, "subpassInput"),
        &plain,
        "reader: its fragment shader 'test shader' reads colour target 2",
    );
    refused(&at(1, "subpassInput"), &plain, "which is a usubpassInput, as a subpassInput");
    refused(&at(0, "isubpassInput"), &plain, "which is a subpassInput, as a isubpassInput");
    refused(&at(0, "subpassInputMS"), &plain, "take a type without MS");
    let four = RenderPipelineDesc { samples: 4, ..plain };
    refused(&at(0, "subpassInput"), &four, "take a type with MS");
    let depth = "LVK_DEPTH_INPUT(subpassInput, gIn);";
    refused(depth, &plain, "reads the depth target, but it draws to no depth target");
    let writes = RenderPipelineDesc { depth: depth_test(Format::D32Float, true), ..plain };
    refused(depth, &writes, "which the pipeline also writes; turn the writes off");
    if ctx.capabilities().limits.max_input_attachments == 10 {
        let stencil = "LVK_STENCIL_INPUT(usubpassInput, gIn);";
        refused(
            stencil,
            &writes,
            "reads the stencil of the depth target, but it draws to a depth target without stencil",
        );
    }
}

#[test]
fn passes_have_what_their_pipelines_read() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let formats = [Format::Rgba8Unorm.into()];
    let desc = RenderPipelineDesc { color: &formats, debug_name: "reader", ..Default::default() };
    let reader = color_pipeline(&ctx, READS_FIRST, &desc).unwrap();
    let (with, without) = (input(&ctx, Format::Rgba8Unorm), target(&ctx, Format::Rgba8Unorm, SIZE));
    let begin = |color: &[ColorAttachment], local_read: bool, words: &str| {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        let desc = RenderPassDesc { color, local_read, debug_name: "lit", ..Default::default() };
        let mut pass = match cmd.begin_rendering(&desc) {
            Ok(pass) => pass,
            Err(error) => return usage_error(Err::<(), _>(error), words),
        };
        usage_error(pass.bind_render_pipeline(*reader), words);
        if !local_read {
            usage_error(pass.read_targets(), "the pass was begun without RenderPassDesc::local_read");
        }
    };
    let cleared = |texture| [ColorAttachment::clear(texture, [0.0; 4])];
    begin(
        &cleared(*with),
        false,
        "reader: its fragment shader reads colour target 0, but the pass was begun without",
    );
    begin(&cleared(*without), true, "lit: local_read is on, but no target has TextureUsage::INPUT");
    let two = [cleared(*without)[0], cleared(*with)[0]];
    let formats = [Format::Rgba8Unorm.into(); 2];
    let both = RenderPipelineDesc { color: &formats, debug_name: "reader", ..Default::default() };
    let reader = color_pipeline(&ctx, READS_FIRST, &both).unwrap();
    let desc = RenderPassDesc { color: &two, local_read: true, ..Default::default() };
    run_pass(&ctx, &desc, |pass| {
        usage_error(
            pass.bind_render_pipeline(*reader),
            "colour target 0, whose texture lacks TextureUsage::INPUT",
        );
        Ok(())
    });
    let reads_depth = "
        LVK_DEPTH_INPUT(subpassInput, gDepth);
        layout(location = 0) out vec4 result;
        void main() { result = subpassLoad(gDepth); }";
    let formats = [Format::Rgba8Unorm.into()];
    let depth = depth_test(Format::D32Float, false);
    let desc =
        RenderPipelineDesc { color: &formats, depth, debug_name: "depth reader", ..Default::default() };
    let reader = color_pipeline(&ctx, reads_depth, &desc).unwrap();
    let deep = input(&ctx, Format::D32Float);
    let color = cleared(*without);
    let depth = Some(DepthAttachment::clear(*deep, 1.0));
    run_pass(
        &ctx,
        &RenderPassDesc { color: &color, depth, local_read: true, ..Default::default() },
        |pass| {
            pass.bind_render_pipeline(*reader)?;
            let write = DepthState { compare: CompareOp::Always, write: true };
            usage_error(pass.depth_state(write), "depth reader: its fragment shader reads the depth target");
            pass.depth_state(DepthState { write: false, ..write })
        },
    );
}

#[test]
fn textures_that_cannot_be_inputs_are_refused() {
    let Some(ctx) = device().filter(|ctx| has(ctx, OptionalFeature::LocalRead)) else { return };
    let plain = TextureDesc { usage: READ, debug_name: "made", ..Default::default() };
    let alone = TextureDesc { usage: TextureUsage::INPUT | TextureUsage::SAMPLED, ..plain };
    usage_error(ctx.create_texture(&alone), "made: INPUT is for what a pass draws to");
    let volume = TextureDesc { kind: TextureKind::D3 { depth: 2 }, ..plain };
    usage_error(ctx.create_texture(&volume), "made: slices of a volume");
    let transient =
        TextureDesc { memory: TextureMemory::Transient, usage: READ | TextureUsage::SAMPLED, ..plain };
    usage_error(ctx.create_texture(&transient), "TARGET and INPUT, and no other");
    // A pass that reads a texture as a target cannot sample it too.
    let both = input(&ctx, Format::Rgba8Unorm);
    let color = [ColorAttachment::clear(*both, [0.0; 4])];
    let dependencies = Dependencies { sampled_images: &[*both], ..Default::default() };
    let desc = RenderPassDesc { color: &color, dependencies, local_read: true, ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    usage_error(cmd.begin_rendering(&desc).map(drop), "input");
}

#[test]
fn devices_without_local_reads_say_so() {
    let profile = DeviceProfile::core_only();
    let Some(ctx) = device_with(|desc| desc.profile = Some(&profile)) else { return };
    assert_eq!(ctx.capabilities().limits.max_input_attachments, 0);
    let desc = TextureDesc { usage: READ, debug_name: "albedo", ..Default::default() };
    unsupported(ctx.create_texture(&desc), "the usage INPUT of texture 'albedo'");
    let source = lvk::ShaderSource::Glsl(READS_FIRST);
    let stage = ShaderStage::Fragment;
    let desc = lvk::ShaderModuleDesc { stage, source, debug_name: "lighting", ..Default::default() };
    unsupported(ctx.create_shader_module(&desc), "InputAttachment of shader 'lighting'");
    let plain = target(&ctx, Format::Rgba8Unorm, SIZE);
    let color = [ColorAttachment::clear(*plain, [0.0; 4])];
    let desc = RenderPassDesc { color: &color, local_read: true, debug_name: "lit", ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    unsupported(cmd.begin_rendering(&desc).map(drop), "not supported: local_read of the pass 'lit': ");
}
