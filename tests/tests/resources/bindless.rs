//! The bindless descriptor set: indices are stable, slots are not reused too early, and full arrays return an error.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferHandle, Context, Dependencies, Error, Format, Holder, SamplerDesc, TextureDesc, TextureHandle,
    TextureUsage,
};
use lvk_tests::compute::{Evaluator, read_vec4, vec4_buffer};
use lvk_tests::{device, device_with};

fn flat(ctx: &Context, value: f32) -> lvk::Result<Holder<TextureHandle>> {
    let texels = [value; 4];
    let data = Some(bytemuck::cast_slice(&texels));
    ctx.create_texture(&TextureDesc { format: Format::R32Float, extent: [2, 2], data, ..Default::default() })
}

const FETCH: &str = "textureBindlessFetch2D(a, ivec2(i % 2, i / 2), 0)";

#[test]
fn the_default_descriptor_is_magenta_and_black() {
    let Some(ctx) = device() else { return };
    let (magenta, black) = ([1.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]);
    let checker = [magenta, black, black, magenta];
    let fetch = Evaluator::new(&ctx, FETCH);
    for slot in [0, 1, 2, 1000] {
        assert_eq!(fetch.run(&ctx, [slot, 0, 0], 4, &Dependencies::default()), checker, "slot {slot}");
    }
    let texture = flat(&ctx, 5.0).unwrap();
    let slot = texture.index();
    assert_eq!(fetch.run(&ctx, [slot, 0, 0], 1, &Dependencies::default())[0][0], 5.0);
    drop(texture);
    ctx.wait_idle().unwrap();
    assert_eq!(fetch.run(&ctx, [slot, 0, 0], 4, &Dependencies::default()), checker, "after its owner went");
    let sampled = Evaluator::new(&ctx, "textureBindless2D(0, 0, vec2(0.25))");
    assert_eq!(sampled.run(&ctx, [0; 3], 1, &Dependencies::default()), [magenta]);
}

#[test]
fn textures_without_sampling_read_as_the_default_descriptor() {
    let Some(ctx) = device() else { return };
    let desc = TextureDesc { usage: TextureUsage::STORAGE, ..Default::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    let fetch = Evaluator::new(&ctx, FETCH);
    let found = fetch.run(&ctx, [texture.index(), 0, 0], 1, &Dependencies::default());
    assert_eq!(found, [[1.0, 0.0, 1.0, 1.0]]);
}

#[test]
fn an_index_stays_with_its_texture() {
    let Some(ctx) = device() else { return };
    let fetch = Evaluator::new(&ctx, FETCH);
    let mut textures: Vec<_> = (0..40).map(|value| (value, flat(&ctx, value as f32).unwrap())).collect();
    let before: Vec<_> = textures.iter().map(|(_, texture)| texture.index()).collect();
    assert!(before.iter().all(|index| *index != 0));
    textures.retain(|(value, _)| value % 3 == 0);
    let news: Vec<_> = (40..60).map(|value| (value, flat(&ctx, value as f32).unwrap())).collect();
    for (value, texture) in textures.iter().chain(&news) {
        let found = fetch.run(&ctx, [texture.index(), 0, 0], 1, &Dependencies::default());
        assert_eq!(found[0][0], *value as f32);
        assert!(*value >= 40 || texture.index() == before[*value as usize]);
    }
}

/// Every frame makes a texture, draws on it and drops it at once; a slot taken too early would show another's value.
#[test]
fn textures_that_come_and_go_with_frames_in_flight_keep_their_contents() {
    let Some(ctx) = device_with(|desc| desc.max_textures = 24) else { return };
    let fetch = Evaluator::new(&ctx, FETCH);
    let mut results: Vec<(f32, Holder<BufferHandle>)> = Vec::new();
    for frame in 0..120 {
        ctx.next_frame().unwrap();
        let textures = [0, 1, 2].map(|part| flat(&ctx, (3 * frame + part) as f32).unwrap());
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for (part, texture) in (0..).zip(&textures) {
            let result = vec4_buffer(&ctx, 1);
            fetch.record(&ctx, &mut cmd, [texture.index(), 0, 0], (*result, 1), &Dependencies::default());
            results.push(((3 * frame + part) as f32, result));
        }
        let [_, dropped_early, _] = textures;
        drop(dropped_early);
        ctx.submit(cmd).unwrap();
    }
    for (expected, result) in &results {
        assert_eq!(read_vec4(&ctx, **result, 1)[0][0], *expected);
    }
}

/// The layout, its pool and the pipelines' layout are made at the edge of the device's limits, with more than the usual of
/// everything else in them.
#[test]
fn as_many_textures_as_the_device_allows_are_there_beside_everything_else() {
    let Some(ctx) = device_with(|desc| {
        desc.max_textures = u32::MAX;
        desc.max_yuv_textures = 1_024;
    }) else {
        return;
    };
    let fetch = Evaluator::new(&ctx, FETCH);
    let texture = flat(&ctx, 3.0).unwrap();
    let found = fetch.run(&ctx, [texture.index(), 0, 0], 1, &Dependencies::default());
    assert_eq!(found[0][0], 3.0);
}

/// A command buffer that is still open may use a texture destroyed meanwhile.
#[test]
fn open_command_buffers_hold_slots() {
    let Some(ctx) = device_with(|desc| desc.max_textures = 4) else { return };
    let fetch = Evaluator::new(&ctx, FETCH);
    let result = vec4_buffer(&ctx, 1);
    let texture = flat(&ctx, 7.0).unwrap();
    let mut open = ctx.acquire_command_buffer().unwrap();
    fetch.record(&ctx, &mut open, [texture.index(), 0, 0], (*result, 1), &Dependencies::default());
    drop(texture);
    let mut kept = Vec::new();
    for value in 0..8 {
        ctx.wait_idle().unwrap();
        kept.extend(flat(&ctx, 100.0 + value as f32));
    }
    assert_eq!(kept.len(), 2);
    ctx.submit(open).unwrap();
    assert_eq!(read_vec4(&ctx, *result, 1)[0][0], 7.0);
    assert!(flat(&ctx, 8.0).is_ok());
}

#[test]
fn running_out_of_textures_is_an_error_that_passes() {
    let Some(ctx) = device_with(|desc| desc.max_textures = 8) else { return };
    let textures: Vec<_> = (0..7).map(|value| flat(&ctx, value as f32).unwrap()).collect();
    match flat(&ctx, 7.0) {
        Err(Error::LimitExceeded { requested, limit, .. }) => assert_eq!((requested, limit), (8, 7)),
        other => unreachable!("{other:?}"),
    }
    drop(textures);
    ctx.wait_idle().unwrap();
    let fetch = Evaluator::new(&ctx, FETCH);
    let textures: Vec<_> = (0..7).map(|value| flat(&ctx, 10.0 + value as f32).unwrap()).collect();
    for (value, texture) in (0..).zip(&textures) {
        let found = fetch.run(&ctx, [texture.index(), 0, 0], 1, &Dependencies::default());
        assert_eq!(found[0][0], 10.0 + value as f32);
    }
}

#[test]
fn failed_creations_free_their_slot() {
    let Some(ctx) = device_with(|desc| desc.max_textures = 4) else { return };
    for _ in 0..16 {
        let bad = [
            TextureDesc { extent: [0, 0], ..Default::default() },
            TextureDesc { data: Some(&[1]), ..Default::default() },
        ];
        for desc in bad {
            assert!(matches!(ctx.create_texture(&desc), Err(Error::InvalidUsage { .. })));
        }
        ctx.wait_idle().unwrap();
    }
    let made: Vec<_> = (0..3).map(|value| flat(&ctx, value as f32).unwrap()).collect();
    assert_eq!(made.len(), 3);
}

#[test]
fn resources_made_after_the_pipeline_and_while_recording_are_seen() {
    let Some(ctx) = device() else { return };
    let fetch = Evaluator::new(&ctx, "textureBindless2D(a, b, vec2(0.5))");
    let result = vec4_buffer(&ctx, 1);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let texture = flat(&ctx, 3.5).unwrap();
    let sampler = ctx.create_sampler(&SamplerDesc::default()).unwrap();
    let words = [texture.index(), sampler.index(), 0];
    fetch.record(&ctx, &mut cmd, words, (*result, 1), &Dependencies::default());
    let _later = flat(&ctx, 9.0).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_vec4(&ctx, *result, 1)[0][0], 3.5);
}

#[test]
fn indices_may_differ_between_invocations() {
    let Some(ctx) = device() else { return };
    let textures: Vec<_> = (0..16).map(|value| flat(&ctx, value as f32).unwrap()).collect();
    let indices: Vec<_> = textures.iter().map(|texture| texture.index()).collect();
    assert!(indices.windows(2).all(|pair| pair[1] == pair[0] + 1), "the test counts on it: {indices:?}");
    let pipeline = lvk_tests::compute::compute_pipeline(
        &ctx,
        "layout(local_size_x = 16) in;
         layout(buffer_reference, scalar) writeonly buffer Result { vec4 values[]; };
         layout(push_constant, scalar) uniform Push { Result result; uint first; };
         void main() {
             uint i = gl_LocalInvocationIndex;
             result.values[i] = textureBindlessFetch2D(first + (i * 7) % 16, ivec2(0), 0);
         }",
    );
    let result = vec4_buffer(&ctx, 16);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let address = ctx.buffer_address(*result).unwrap();
    cmd.push_constants(&[address as u32, (address >> 32) as u32, indices[0]]).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    let found: Vec<_> = read_vec4(&ctx, *result, 16).into_iter().map(|value| value[0]).collect();
    let expected: Vec<_> = (0..16).map(|i| ((i * 7) % 16) as f32).collect();
    assert_eq!(found, expected);
}
