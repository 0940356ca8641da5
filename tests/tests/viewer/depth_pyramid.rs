//! The shaders of occlusion culling against brute force: depth pyramids, and bounds of boxes in the picture.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, Vec3};
use lvk::{
    ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Format, Holder, ShaderModuleDesc,
    ShaderSource, ShaderStage, TextureDesc, TextureUsage,
};
use lvk_samples::scene::{Camera, GpuCamera};
use lvk_samples::shaders::INCLUDES;
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::device;
use lvk_tests::random::Random;

const PYRAMID: &str = include_str!("../../../shaders/viewer/depth_pyramid.comp.glsl");
/// Levels that a dispatch makes.
const LEVELS: u32 = 5;

/// Boxes, and for each the pixels, the depth and the level.
const BOUNDS: &str = "
#include \"viewer/occlusion.glsl\"
layout(local_size_x = 64) in;
struct ScreenBounds { uint hasBounds; uvec2 low; uvec2 high; float depth; uint level; uint padding; };
layout(buffer_reference, scalar) readonly buffer Boxes { Box at[]; };
layout(buffer_reference, scalar) buffer Results { ScreenBounds at[]; };
layout(buffer_reference, scalar) readonly buffer Cameras { Camera at; };
layout(push_constant, scalar) uniform Push { Boxes boxes; Results results; Cameras camera; uint count; uint padding; };
void main() {
    uint number = gl_GlobalInvocationID.x;
    if (number < count) {
        PixelBounds bounds;
        bool hasBounds = boundsOf(boxes.at[number], camera.at, bounds);
        results.at[number] = ScreenBounds(uint(hasBounds), bounds.low, bounds.high, bounds.depth, levelOf(bounds), 0u);
    }
}";

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct PyramidPush {
    pyramid: u64,
    pixels: [u32; 2],
    depth_texture: u32,
    source: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct BoundsPush {
    boxes: u64,
    results: u64,
    camera: u64,
    count: u32,
    padding: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct GpuBox {
    middle: Vec3,
    axes: [Vec3; 3],
    slack: f32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ScreenBounds {
    has_bounds: u32,
    low: [u32; 2],
    high: [u32; 2],
    depth: f32,
    level: u32,
    padding: u32,
}

fn pipeline(ctx: &Context, text: &str) -> Holder<ComputePipelineHandle> {
    let desc = ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(text),
        includes: INCLUDES,
        ..ShaderModuleDesc::default()
    };
    let module = ctx.create_shader_module(&desc).unwrap();
    ctx.create_compute_pipeline(&ComputePipelineDesc { module: Some(*module), ..Default::default() }).unwrap()
}

fn halved(size: [u32; 2]) -> [u32; 2] {
    size.map(|texels| texels.div_ceil(2))
}

/// All levels of a pyramid: each texel is the smallest of up to four below it.
fn levels(mut size: [u32; 2], mut depths: Vec<f32>) -> Vec<f32> {
    let mut all = Vec::new();
    loop {
        let [columns, rows] = halved(size);
        let mut level = vec![f32::INFINITY; (columns * rows) as usize];
        for (place, depth) in depths.iter().enumerate() {
            let (x, y) = (place as u32 % size[0], place as u32 / size[0]);
            let texel = &mut level[(y / 2 * columns + x / 2) as usize];
            *texel = texel.min(*depth);
        }
        all.extend(&level);
        (size, depths) = ([columns, rows], level);
        if size == [1, 1] {
            return all;
        }
    }
}

/// The levels as the shader makes them, five in a dispatch.
fn levels_by_shader(
    ctx: &Context,
    pipeline: ComputePipelineHandle,
    size: [u32; 2],
    depths: &[f32],
    count: usize,
) -> Vec<f32> {
    let data = Some(bytemuck::cast_slice(depths));
    let usage = TextureUsage::SAMPLED;
    let desc = TextureDesc { format: Format::R32Float, extent: size, usage, data, ..TextureDesc::default() };
    let texture = ctx.create_texture(&desc).unwrap();
    let buffer = words_buffer(ctx, &vec![0; count]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(pipeline).unwrap();
    let dependencies =
        Dependencies { buffers: &[*buffer], sampled_images: &[*texture], ..Dependencies::default() };
    let (mut source, mut left) = (0, size);
    while source == 0 || left != [1, 1] {
        let pyramid = ctx.buffer_address(*buffer).unwrap();
        let push = PyramidPush { pyramid, pixels: size, depth_texture: texture.index(), source };
        cmd.push_constants(&push).unwrap();
        left = (0..LEVELS).fold(left, |size, _| halved(size));
        cmd.dispatch([left[0], left[1], 1], &dependencies).unwrap();
        source += LEVELS;
    }
    ctx.submit(cmd).unwrap();
    read_words(ctx, *buffer, count).into_iter().map(f32::from_bits).collect()
}

#[test]
fn a_pyramid_has_the_farthest_depth_of_every_region() {
    let Some(ctx) = device() else { return };
    let pipeline = pipeline(&ctx, PYRAMID);
    for size in
        [[1, 1], [2, 1], [1, 33], [32, 32], [33, 31], [61, 37], [65, 64], [129, 5], [320, 180], [1100, 3]]
    {
        let mut random = Random::new(size[0].into());
        let depths: Vec<f32> = (0..size[0] * size[1]).map(|_| random.between(0.0, 1.0)).collect();
        let expected = levels(size, depths.clone());
        let actual = levels_by_shader(&ctx, *pipeline, size, &depths, expected.len());
        assert!(actual == expected, "{size:?}");
    }
}

/// Boxes of all sizes, turned in all ways, around the eye and ahead.
fn boxes(count: usize) -> Vec<GpuBox> {
    let mut random = Random::new(7);
    let mut vector = move |extent: f32| random.point(Vec3::splat(-extent), Vec3::splat(extent));
    (0..count)
        .map(|number| {
            let size = 3.0 * 0.6_f32.powi(number as i32 % 12);
            let middle = vector(20.0);
            GpuBox { middle, axes: [0; 3].map(|_| vector(size)), slack: 0.0 }
        })
        .collect()
}

fn bounds_by_shader(ctx: &Context, camera: &GpuCamera, boxes: &[GpuBox]) -> Vec<ScreenBounds> {
    let pipeline = pipeline(ctx, BOUNDS);
    let [boxes_buffer, camera_buffer] = [bytemuck::cast_slice(boxes), bytemuck::bytes_of(camera)]
        .map(|bytes| words_buffer(ctx, &bytemuck::pod_collect_to_vec::<u8, u32>(bytes)));
    let words = boxes.len() * size_of::<ScreenBounds>() / 4;
    let results = words_buffer(ctx, &vec![0; words]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let [boxes_address, results_address, camera] =
        [*boxes_buffer, *results, *camera_buffer].map(|buffer| ctx.buffer_address(buffer).unwrap());
    let count = boxes.len() as u32;
    let push = BoundsPush { boxes: boxes_address, results: results_address, camera, count, padding: 0 };
    cmd.push_constants(&push).unwrap();
    let dependencies = Dependencies {
        buffers: &[*results],
        read_buffers: &[*boxes_buffer, *camera_buffer],
        ..Dependencies::default()
    };
    cmd.dispatch([count.div_ceil(64), 1, 1], &dependencies).unwrap();
    ctx.submit(cmd).unwrap();
    bytemuck::pod_collect_to_vec(&read_words(ctx, *results, words))
}

/// The camera in f64, from its own numbers.
struct View {
    axes: DMat3,
    shift: [f64; 2],
    size: [f64; 2],
    near: f64,
}

impl View {
    /// Reads the numbers as `common/camera.glsl` lays them out.
    fn new(camera: &GpuCamera) -> Self {
        let words: [u32; 24] = bytemuck::cast(*camera);
        let number = |place: usize| f64::from(f32::from_bits(words[place]));
        let [forward, right, down] =
            [4, 16, 19].map(|first| DVec3::from([0, 1, 2].map(|axis| number(first + axis))));
        Self {
            axes: DMat3::from_cols(right, down, forward).transpose(),
            shift: [number(22), number(23)],
            size: [words[11], words[15]].map(f64::from),
            near: number(3),
        }
    }

    /// Place in pixels and distance along the view of a point, relative to the eye.
    fn project(&self, point: DVec3) -> ([f64; 2], f64) {
        let clip = self.axes * point;
        let place =
            [0, 1].map(|axis| (0.5 * (clip[axis] / clip.z - self.shift[axis]) + 0.5) * self.size[axis]);
        (place, clip.z)
    }
}

/// Asserts that what the shader says holds every point of a box, and no level is coarser than it needs to be.
fn check(view: &View, GpuBox { middle, axes, .. }: &GpuBox, bounds: &ScreenBounds) {
    let corner = |signs: [f64; 3]| {
        let steps = axes.iter().zip(signs).map(|(axis, sign)| sign * axis.as_dvec3());
        middle.as_dvec3() + steps.sum::<DVec3>()
    };
    let sides = [-1.0, -0.3, 0.5, 1.0];
    let points: Vec<_> = (0..64)
        .map(|number: usize| [number % 4, number / 4 % 4, number / 16].map(|place| sides[place]))
        .map(|signs| view.project(corner(signs)))
        .collect();
    let nearest = points.iter().map(|(_, distance)| *distance).fold(f64::INFINITY, f64::min);
    if bounds.has_bounds == 0 {
        assert!(nearest < view.near * 1.001 + 1e-3, "{nearest} is before the near plane");
        return;
    }
    assert!(nearest > 0.999 * view.near, "{nearest} is behind the near plane");
    let depth = view.near / nearest;
    assert!((depth..1.01 * depth).contains(&f64::from(bounds.depth)), "{depth}, {bounds:?}");
    for axis in 0..2 {
        let places = points.iter().map(|(place, _)| place[axis]);
        let clamped = |place: f64| place.clamp(0.0, view.size[axis] - 1.0).floor();
        let [low, high] =
            [places.clone().fold(f64::INFINITY, f64::min), places.fold(f64::NEG_INFINITY, f64::max)];
        let [found_low, found_high] = [bounds.low[axis], bounds.high[axis]].map(f64::from);
        assert!(found_low <= clamped(low) && clamped(high) <= found_high, "{low} to {high}, {bounds:?}");
        assert!(
            clamped(low - 2.0) <= found_low && found_high <= clamped(high + 2.0),
            "{low} to {high}, {bounds:?}"
        );
    }
    let texels = |level: u32| {
        let along = |axis: usize| (bounds.high[axis] >> level) - (bounds.low[axis] >> level) + 1;
        along(0).max(along(1))
    };
    assert!(texels(bounds.level) <= 4, "{bounds:?}");
    assert!(bounds.level == 1 || texels(bounds.level - 1) > 4, "{bounds:?}");
}

#[test]
fn bounds_hold_every_point_of_a_box_and_little_more() {
    let Some(ctx) = device() else { return };
    let boxes = boxes(4_000);
    for (target, fov, [width, height]) in [
        ([1.0, 2.0, -3.0], 60.0, [61, 37]),
        ([0.0, -1.0, 0.2], 100.0, [320, 180]),
        ([1.0, 0.0, 0.0], 20.0, [7, 1]),
    ] {
        let camera = Camera::looking_at([0.0; 3], target, fov);
        let camera = GpuCamera::new(&camera, width, height, 0.01).for_sample(3, u32::MAX);
        let view = View::new(&camera);
        let bounds = bounds_by_shader(&ctx, &camera, &boxes);
        boxes.iter().zip(&bounds).for_each(|(one, bounds)| check(&view, one, bounds));
        let count = bounds.iter().filter(|bounds| bounds.has_bounds != 0).count();
        assert!((boxes.len() / 10..boxes.len()).contains(&count), "{count} boxes have bounds");
    }
}
