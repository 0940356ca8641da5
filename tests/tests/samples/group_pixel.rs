//! The pixel that each invocation of a workgroup computes, as the samples' compute shaders divide an image.

use bytemuck::{Pod, Zeroable};
use lvk::{
    ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Holder, Result, ShaderModuleDesc,
    ShaderSource, ShaderStage,
};
use lvk_samples::shaders::INCLUDES;
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::device;

/// Counts how often each pixel is computed, and, after those, how often none is.
const TEXT: &str = "
#include \"common/group_pixel.glsl\"

layout(buffer_reference, scalar) buffer Counts { uint at[]; };
layout(push_constant, scalar) uniform Push { Counts counts; uint width; uint height; };

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        bool isInside = pixel.x < width && pixel.y < height;
        atomicAdd(counts.at[isInside ? pixel.y * width + pixel.x : width * height], 1u);
    }
}";

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    counts: u64,
    size: [u32; 2],
}

fn counting(ctx: &Context) -> Result<Holder<ComputePipelineHandle>> {
    let module = ctx.create_shader_module(&ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(TEXT),
        includes: INCLUDES,
        debug_name: "group pixel",
        ..Default::default()
    })?;
    ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() })
}

fn check(ctx: &Context, pipeline: ComputePipelineHandle, size: [u32; 2]) -> Result<()> {
    let [width, height] = size;
    let pixels = (width * height) as usize;
    let buffer = words_buffer(ctx, &vec![0; pixels + 1]);
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.push_constants(&Push { counts: ctx.buffer_address(*buffer)?, size })?;
    let groups = size.map(|side| side.div_ceil(8));
    let dependencies = Dependencies { buffers: &[*buffer], ..Dependencies::default() };
    cmd.dispatch([groups[0], groups[1], 1], &dependencies)?;
    ctx.submit(cmd)?;
    let counts = read_words(ctx, *buffer, pixels + 1);
    assert!(counts[..pixels].iter().all(|count| *count == 1), "{width} x {height}: {counts:?}");
    assert_eq!(counts[pixels], groups[0] * groups[1] * 64 - width * height, "{width} x {height}");
    Ok(())
}

#[test]
fn every_pixel_is_seen_once() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let pipeline = counting(&ctx)?;
    let odd = [[1, 1], [7, 3], [33, 17], [100, 41], [160, 90], [9, 1000]];
    let of_every_count_of_rows = (1..=40).map(|rows| [20, rows * 8]);
    odd.into_iter().chain(of_every_count_of_rows).try_for_each(|size| check(&ctx, *pipeline, size))
}
