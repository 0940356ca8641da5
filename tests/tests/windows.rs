//! Swapchains in windows of an X server without a screen.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use std::sync::{Arc, Mutex, PoisonError};

use lvk::test_hooks::{descriptor_slots, fail_submission_after, waiting_objects, with_fault_injection};
use lvk::*;
use lvk_tests::device::vulkan;
use lvk_tests::random::Random;
use lvk_tests::strange_window::{self, Strange, expect_refused};
use lvk_tests::subprocess::on_swiftshader;
use lvk_tests::warnings::{capture_warnings, take_warnings};
use lvk_tests::windows::{TestWindow, desktop, fill, present_color, present_until_visible};
use lvk_tests::{TestDevice, device, device_with};

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

/// A window and a context for it. One thread at a time asks about the X connection: lavapipe 25.0.7 reads a null pointer where two
/// threads ask for the first time, as contexts of two tests do (docs/drivers.md).
fn window_with<'a>(adjust: impl FnOnce(&mut ContextDesc<'a>)) -> Option<(Arc<TestWindow>, TestDevice)> {
    static ASKED: Mutex<()> = Mutex::new(());
    let window = desktop()?.window([64, 48]);
    let _asked = ASKED.lock().unwrap_or_else(PoisonError::into_inner);
    let ctx = device_with(|desc| {
        desc.window = Some(window.clone());
        adjust(desc);
    })?;
    Some((window, ctx))
}

fn window() -> Option<(Arc<TestWindow>, TestDevice)> {
    window_with(|_| {})
}

/// The device as it is without fences and modes of single presents.
fn without_maintenance() -> DeviceProfile {
    DeviceProfile {
        name: "no swapchain maintenance".into(),
        hidden: FeatureSet::NONE.with(OptionalFeature::SwapchainMaintenance1),
        ..Default::default()
    }
}

fn message<T: std::fmt::Debug>(result: Result<T>) -> String {
    let error = result.unwrap_err();
    assert!(matches!(error, Error::InvalidUsage { .. }), "{error:?}");
    error.to_string()
}

#[test]
fn contexts_without_a_window_use_no_extension_of_window_systems() {
    let Some(ctx) = device() else { return };
    for name in [c"vkDestroySurfaceKHR", c"vkGetPhysicalDeviceSurfaceSupportKHR"] {
        let instance = ctx.raw_instance().handle();
        // SAFETY: the instance is alive.
        let found = unsafe { (ctx.raw_entry().static_fn().get_instance_proc_addr)(instance, name.as_ptr()) };
        assert!(found.is_none(), "{name:?}");
    }
    assert!(!ctx.capabilities().has(OptionalFeature::Swapchain));
    assert!(message(ctx.create_swapchain(&SwapchainDesc::default())).contains("ContextDesc::window"));
    let Some(desktop) = desktop() else { return };
    let desc = SwapchainDesc { window: Some(desktop.window([8, 8])), ..Default::default() };
    let error = ctx.create_swapchain(&desc).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }), "{error:?}");
}

#[test]
fn images_come_to_the_window_and_can_be_read_before() {
    let Some((window, ctx)) = window() else { return };
    assert!(ctx.capabilities().has(OptionalFeature::Swapchain));
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    let info = ctx.swapchain_info(*swapchain).unwrap();
    assert_eq!((info.extent, info.color_space, info.rebuilds), ([64, 48], ColorSpace::Srgb, 0));
    assert!(info.image_count >= 2 && info.present_modes.contains(&PresentMode::Fifo));
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    assert_eq!((image.extent(), image.format()), ([64, 48], info.format));
    let texture = image.texture();
    ctx.submit(fill(&ctx, texture, GREEN).unwrap()).unwrap();
    let texels = ctx.download_texture(texture, &TextureRegion::default()).unwrap();
    assert!(texels.chunks(4).all(|texel| texel == [0, 255, 0, 255]));
    // Drawn by an earlier submission, so this one has nothing to do but to present.
    ctx.present(ctx.acquire_command_buffer().unwrap(), image).unwrap();
    for color in [RED, GREEN, BLUE] {
        present_until_visible(&ctx, *swapchain, &window, color);
    }
}

/// Texture numbers are so few that those of swapchains that are gone have to come back.
fn resize_often(window: &TestWindow, ctx: &Context, times: u32) {
    let swapchain = ctx.create_swapchain(&SwapchainDesc { image_count: 3, ..Default::default() }).unwrap();
    let mut random = Random::new(7);
    let (mut resized, mut shown) = (0, 0);
    // The number of sizes that a driver notices of a fast sequence depends on the load of the machine.
    while resized < times || ctx.swapchain_info(*swapchain).unwrap().rebuilds <= u64::from(times) / 3 {
        assert!(resized < 20 * times, "{:?}", ctx.swapchain_info(*swapchain));
        resized += 1;
        window.resize([1 + random.bits() as u32 % 190, 1 + random.bits() as u32 % 190]);
        ctx.next_frame().unwrap();
        for _ in 0..random.bits() % 3 {
            shown += u32::from(present_color(ctx, *swapchain, BLUE).unwrap().is_some());
        }
    }
    assert!(shown > times / 2, "{shown} of {resized}");
    window.resize([33, 21]);
    // Drivers may notice one image too late.
    let fits = |_: &u32| {
        present_color(ctx, *swapchain, BLUE).unwrap();
        ctx.swapchain_info(*swapchain).unwrap().extent == [33, 21]
    };
    assert!((0..50).find(fits).is_some(), "{:?}", ctx.swapchain_info(*swapchain));
    present_until_visible(ctx, *swapchain, window, RED);
    let info = ctx.swapchain_info(*swapchain).unwrap();
    // Left alone, it stays.
    for _ in 0..5 {
        present_color(ctx, *swapchain, GREEN).unwrap();
    }
    assert_eq!(ctx.swapchain_info(*swapchain).unwrap().rebuilds, info.rebuilds);
}

#[test]
fn two_hundred_resizes_are_followed() {
    let Some((window, ctx)) = window_with(|desc| desc.max_textures = 64) else { return };
    resize_often(&window, &ctx, 200);
}

#[test]
fn resizes_are_followed_without_fences_of_presents() {
    let profile = without_maintenance();
    let window = window_with(|desc| {
        desc.max_textures = 64;
        desc.profile = Some(&profile);
    });
    let Some((window, ctx)) = window else { return };
    assert!(!ctx.capabilities().has(OptionalFeature::SwapchainMaintenance1));
    resize_often(&window, &ctx, 60);
}

#[test]
fn resizes_are_followed_on_another_driver() {
    on_swiftshader(resizes_are_followed_on_another_driver, || {
        let Some((window, ctx)) = window_with(|desc| desc.max_textures = 64) else { return };
        resize_often(&window, &ctx, 60);
    });
}

/// Also while a command buffer that was never submitted keeps the old swapchain.
#[test]
fn a_lost_surface_is_replaced() {
    let Some((window, ctx)) = window() else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    for (lost, color) in [(1, RED), (2, GREEN), (3, BLUE)] {
        let image = ctx.next_image(*swapchain).unwrap().unwrap();
        let stale = fill(&ctx, image.texture(), RED).unwrap();
        let stale = if lost == 2 { None } else { Some(stale) };
        lvk::test_hooks::lose_surface(&ctx, *swapchain).unwrap();
        present_until_visible(&ctx, *swapchain, &window, color);
        assert_eq!(ctx.swapchain_info(*swapchain).unwrap().rebuilds, lost);
        let late = ctx.present(ctx.acquire_command_buffer().unwrap(), image);
        assert!(message(late).contains("made anew"));
        if let Some(stale) = stale {
            assert!(message(ctx.submit(stale)).contains("made anew"));
        }
    }
}

/// Nothing waits for the window system for ever.
#[test]
fn a_lost_surface_is_replaced_though_a_present_never_ends() {
    let Some((window, ctx)) = window() else { return };
    let desc = SwapchainDesc { debug_name: "stalling window", ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    present_color(&ctx, *swapchain, RED).unwrap().unwrap();
    if !lvk::test_hooks::stall_present(&ctx, *swapchain).unwrap() {
        return eprintln!("NOT TESTED, {} tells of no presents", ctx.capabilities().device_name);
    }
    capture_warnings();
    lvk::test_hooks::lose_surface(&ctx, *swapchain).unwrap();
    present_color(&ctx, *swapchain, GREEN).unwrap().unwrap();
    assert_eq!(take_warnings("stalling window").len(), 1);
    present_until_visible(&ctx, *swapchain, &window, BLUE);
    // Nor does its end.
    assert!(lvk::test_hooks::stall_present(&ctx, *swapchain).unwrap());
    drop(swapchain);
    ctx.wait_idle().unwrap();
    assert_eq!(take_warnings("stalling window").len(), 1);
}

#[test]
fn three_windows_render_their_own_images() {
    let Some((first, ctx)) = window() else { return };
    let Some(desktop) = desktop() else { return };
    let windows = [first, desktop.window([40, 30]), desktop.window([20, 50])];
    let swapchains: Vec<_> = windows
        .iter()
        .map(|window| {
            let desc = SwapchainDesc { window: Some(window.clone()), ..Default::default() };
            ctx.create_swapchain(&desc).unwrap()
        })
        .collect();
    // All three in one frame, and the images of two taken at once.
    for _ in 0..4 {
        ctx.next_frame().unwrap();
        let images: Vec<_> = swapchains.iter().map(|one| ctx.next_image(**one).unwrap().unwrap()).collect();
        for (image, color) in images.into_iter().zip([RED, GREEN, BLUE]) {
            let cmd = fill(&ctx, image.texture(), color).unwrap();
            ctx.present(cmd, image).unwrap();
        }
    }
    for ((swapchain, window), color) in swapchains.iter().zip(&windows).zip([RED, GREEN, BLUE]) {
        present_until_visible(&ctx, **swapchain, window, color);
    }
    for ((swapchain, window), extent) in swapchains.iter().zip(&windows).zip([[64, 48], [40, 30], [20, 50]]) {
        assert_eq!(ctx.swapchain_info(**swapchain).unwrap().extent, extent);
        assert_ne!(window.pixel(1, 1), [0, 0, 0]);
    }
}

/// Every mode the window has, one after the other.
fn switch_modes(ctx: &Context) -> (u64, usize) {
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    assert_eq!(ctx.swapchain_info(*swapchain).unwrap().present_mode, PresentMode::Fifo);
    let modes = ctx.swapchain_info(*swapchain).unwrap().present_modes;
    for mode in modes.iter().rev().chain(&modes) {
        ctx.set_present_mode(*swapchain, &[*mode]).unwrap();
        for color in [RED, GREEN, BLUE] {
            present_color(ctx, *swapchain, color).unwrap().unwrap();
        }
        assert_eq!(ctx.swapchain_info(*swapchain).unwrap().present_mode, *mode);
    }
    let all = [PresentMode::Mailbox, PresentMode::Immediate, PresentMode::FifoRelaxed, PresentMode::Fifo];
    ctx.set_present_mode(*swapchain, &all).unwrap();
    present_color(ctx, *swapchain, RED).unwrap().unwrap();
    let info = ctx.swapchain_info(*swapchain).unwrap();
    assert_eq!(Some(info.present_mode), all.into_iter().find(|mode| info.present_modes.contains(mode)));
    (info.rebuilds, modes.len())
}

#[test]
fn present_modes_are_switched() {
    let Some((_window, ctx)) = window() else { return };
    let (rebuilds, modes) = switch_modes(&ctx);
    assert!(modes > 1, "the X server has several");
    if ctx.capabilities().has(OptionalFeature::SwapchainMaintenance1) {
        assert!(rebuilds < modes as u64, "some changes need no swapchain: {rebuilds} for {modes} modes");
    }
}

#[test]
fn present_modes_are_switched_by_new_swapchains() {
    let profile = without_maintenance();
    let Some((_window, ctx)) = window_with(|desc| desc.profile = Some(&profile)) else { return };
    let (rebuilds, modes) = switch_modes(&ctx);
    assert!(rebuilds >= modes as u64, "{rebuilds} for {modes} modes");
}

/// An image is a plain value: whether it is dropped or forgotten makes no difference.
#[test]
fn images_that_are_dropped_or_forgotten_come_again() {
    let Some((window, ctx)) = window() else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    for round in 0..12 {
        let texture = ctx.next_image(*swapchain).unwrap().unwrap().texture();
        if round % 3 == 0 {
            // Used, and yet not presented.
            ctx.submit(fill(&ctx, texture, RED).unwrap()).unwrap();
        }
        let again = ctx.next_image(*swapchain).unwrap().unwrap();
        assert_eq!(again.texture(), texture);
        let cmd = fill(&ctx, texture, GREEN).unwrap();
        ctx.present(cmd, again).unwrap();
    }
    // The value of an image that was given out again is worth nothing, and the image is as it was.
    let old = ctx.next_image(*swapchain).unwrap().unwrap();
    let new = ctx.next_image(*swapchain).unwrap().unwrap();
    let cmd = fill(&ctx, old.texture(), RED).unwrap();
    assert!(message(ctx.present(cmd, old)).contains("given out again"));
    let cmd = fill(&ctx, new.texture(), RED).unwrap();
    ctx.present(cmd, new).unwrap();
    // An image is taken when the window changes, and when the swapchain goes.
    ctx.next_image(*swapchain).unwrap().unwrap();
    ctx.resize_swapchain(*swapchain, [50, 50]).unwrap();
    window.resize([50, 50]);
    present_until_visible(&ctx, *swapchain, &window, BLUE);
    let taken = ctx.next_image(*swapchain).unwrap().unwrap();
    let cmd = fill(&ctx, taken.texture(), RED).unwrap();
    drop(swapchain);
    assert!(matches!(ctx.present(cmd, taken), Err(Error::StaleHandle { kind: "swapchain", .. })));
}

#[test]
fn images_are_used_between_taking_and_presenting_only() {
    let Some((_window, ctx)) = window() else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let texture = image.texture();
    let early = fill(&ctx, texture, RED).unwrap();
    let late = fill(&ctx, texture, RED).unwrap();
    ctx.submit(early).unwrap();
    ctx.present(ctx.acquire_command_buffer().unwrap(), image).unwrap();
    assert!(message(ctx.submit(late)).contains("presentation engine"));
    assert!(
        message(ctx.download_texture(texture, &TextureRegion::default())).contains("presentation engine")
    );
    let upload = ctx.upload_texture(texture, &TextureRegion::default(), &[0; 64 * 48 * 4]);
    assert!(message(upload).contains("command buffer"));
    // The swapchain alone destroys its images.
    ctx.destroy(texture);
    let other = device().unwrap();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    ctx.destroy(image.texture());
    let foreign = other.acquire_command_buffer().unwrap();
    assert!(message(ctx.present(foreign, image)).contains("another context"));
    // Recorded for a swapchain that has been made anew since.
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let stale = fill(&ctx, image.texture(), RED).unwrap();
    ctx.resize_swapchain(*swapchain, [9, 9]).unwrap();
    let next = ctx.next_image(*swapchain).unwrap().unwrap();
    assert!(message(ctx.submit(stale)).contains("made anew"));
    let cmd = fill(&ctx, next.texture(), RED).unwrap();
    assert!(message(ctx.present(cmd, image)).contains("made anew"));
    // None of that broke anything.
    let cmd = fill(&ctx, next.texture(), RED).unwrap();
    ctx.present(cmd, next).unwrap();
}

#[test]
fn views_of_images_may_outlive_the_swapchain() {
    let Some((window, ctx)) = window() else { return };
    let desc = SwapchainDesc {
        usage: TextureUsage::TARGET | TextureUsage::SAMPLED,
        color_spaces: &[ColorSpace::SrgbEncoded],
        ..Default::default()
    };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    assert_eq!(ctx.swapchain_info(*swapchain).unwrap().color_space, ColorSpace::SrgbEncoded);
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let view = TextureViewDesc { texture: Some(image.texture()), debug_name: "view", ..Default::default() };
    let view = ctx.create_texture_view(&view).unwrap();
    let cmd = fill(&ctx, *view, GREEN).unwrap();
    ctx.present(cmd, image).unwrap();
    present_until_visible(&ctx, *swapchain, &window, GREEN);
    drop(swapchain);
    ctx.wait_idle().unwrap();
    assert!(message(ctx.submit(fill(&ctx, *view, RED).unwrap())).contains("made anew"));
    drop(view);
}

#[test]
fn minimised_windows_have_no_images() {
    let Some((window, ctx)) = window() else { return };
    let desc = SwapchainDesc { extent: [0, 0], ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    assert_eq!(ctx.swapchain_info(*swapchain).unwrap().extent, [0, 0]);
    assert!(ctx.next_image(*swapchain).unwrap().is_none());
    ctx.resize_swapchain(*swapchain, [64, 48]).unwrap();
    present_until_visible(&ctx, *swapchain, &window, RED);
    for extent in [[0, 48], [64, 0], [0, 0]] {
        ctx.resize_swapchain(*swapchain, extent).unwrap();
        assert!(present_color(&ctx, *swapchain, BLUE).unwrap().is_none());
        ctx.resize_swapchain(*swapchain, [64, 48]).unwrap();
        assert!(present_color(&ctx, *swapchain, BLUE).unwrap().is_some());
    }
}

/// The driver may wait in its own presents, as lavapipe does, so what is slow is not presented here.
#[test]
fn neither_an_image_nor_a_new_swapchain_waits_for_the_gpu() {
    let Some((window, ctx)) = window() else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc { image_count: 3, ..Default::default() }).unwrap();
    let desc = TextureDesc { extent: [2048, 2048], usage: TextureUsage::TARGET, ..Default::default() };
    let heavy = ctx.create_texture(&desc).unwrap();
    for _ in 0..3 {
        present_color(&ctx, *swapchain, RED).unwrap().unwrap();
    }
    ctx.wait_idle().unwrap();
    let slow = || {
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        for _ in 0..100 {
            let target = ColorAttachment::clear(*heavy, RED);
            drop(cmd.begin_rendering(&RenderPassDesc { color: &[target], ..Default::default() }).unwrap());
        }
        ctx.submit(cmd).unwrap()
    };
    // The frame before still runs: the next image is taken, and drawn into, meanwhile.
    let first = slow();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let drawn = ctx.submit(fill(&ctx, image.texture(), GREEN).unwrap()).unwrap();
    assert!(!ctx.is_done(first).unwrap() && !ctx.is_done(drawn).unwrap(), "an image waited for the GPU");
    // So is a whole swapchain, although an image of the one before is drawn into.
    window.resize([30, 20]);
    ctx.resize_swapchain(*swapchain, [30, 20]).unwrap();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    assert_eq!((image.extent(), ctx.swapchain_info(*swapchain).unwrap().rebuilds), ([30, 20], 1));
    assert!(!ctx.is_done(first).unwrap(), "a new swapchain waited for the GPU");
    let second = ctx.present(fill(&ctx, image.texture(), BLUE).unwrap(), image).unwrap();
    assert!(second > drawn);
    present_until_visible(&ctx, *swapchain, &window, BLUE);
}

#[test]
fn frames_in_flight_overlap_with_one_image_each() {
    let Some((window, ctx)) = window_with(|desc| desc.frames_in_flight = 2) else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    let count = ctx.swapchain_info(*swapchain).unwrap().image_count as usize;
    let mut textures = Vec::new();
    for number in 0..20 {
        ctx.next_frame().unwrap();
        let image = ctx.next_image(*swapchain).unwrap().unwrap();
        if !textures.contains(&image.texture()) {
            textures.push(image.texture());
        }
        let color = if number % 2 == 0 { RED } else { GREEN };
        ctx.present(fill(&ctx, image.texture(), color).unwrap(), image).unwrap();
    }
    assert!(textures.len() > 1 && textures.len() <= count, "{textures:?}");
    present_until_visible(&ctx, *swapchain, &window, BLUE);
}

#[test]
fn a_window_that_is_closed_too_early_is_an_error_and_no_more() {
    let Some((window, ctx)) = window() else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    present_until_visible(&ctx, *swapchain, &window, RED);
    window.close();
    let mut told = None;
    for _ in 0..8 {
        match present_color(&ctx, *swapchain, RED) {
            Ok(_) => {}
            Err(error) => told = Some(error),
        }
    }
    assert!(matches!(told, Some(Error::SurfaceLost { .. })), "{told:?}");
    // The context is as good as before.
    drop(swapchain);
    let Some(desktop) = desktop() else { return };
    let other = desktop.window([16, 16]);
    let desc = SwapchainDesc { window: Some(other.clone()), ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    present_until_visible(&ctx, *swapchain, &other, GREEN);
}

/// As on Android, where the window of an application goes when it is paused: the device stays, nothing leaks, and the
/// validation layer is silent.
#[test]
fn a_swapchain_goes_on_in_another_window() {
    let Some((mut window, ctx)) = window_with(|desc| desc.max_textures = 64) else { return };
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    present_until_visible(&ctx, *swapchain, &window, RED);
    ctx.wait_idle().unwrap();
    let objects = ctx.live_objects();
    for round in 0..24_u32 {
        let acquired = (round % 3 == 1).then(|| ctx.next_image(*swapchain).unwrap().unwrap());
        if round % 4 == 2 {
            // The window goes before anything says so.
            window.close();
            let lost = (0..8).find_map(|_| present_color(&ctx, *swapchain, RED).err());
            assert!(matches!(lost, Some(Error::SurfaceLost { .. })), "{lost:?}");
        }
        ctx.suspend_swapchain(*swapchain).unwrap();
        window.close();
        ctx.suspend_swapchain(*swapchain).unwrap();
        ctx.resize_swapchain(*swapchain, [9, 9]).unwrap();
        assert!(ctx.next_image(*swapchain).unwrap().is_none());
        assert!(message(ctx.swapchain_info(*swapchain)).contains("suspended"));
        if let Some(image) = acquired {
            let late = ctx.present(ctx.acquire_command_buffer().unwrap(), image);
            assert!(message(late).contains("made anew"));
        }
        let extent = [40 + round, 60 - round];
        window = desktop().unwrap().window(extent);
        ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), extent).unwrap();
        assert_eq!(ctx.swapchain_info(*swapchain).unwrap().extent, extent);
        present_until_visible(&ctx, *swapchain, &window, [RED, GREEN, BLUE][round as usize % 3]);
    }
    ctx.wait_idle().unwrap();
    assert_eq!(ctx.live_objects(), objects);
    // The same window comes back, and one is exchanged while it is there.
    ctx.suspend_swapchain(*swapchain).unwrap();
    ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [0, 0]).unwrap();
    assert!(ctx.next_image(*swapchain).unwrap().is_none(), "it is minimised");
    let other = desktop().unwrap().window([20, 10]);
    ctx.resume_swapchain(*swapchain, &(other.clone() as Arc<_>), [20, 10]).unwrap();
    present_until_visible(&ctx, *swapchain, &other, GREEN);
    let second =
        ctx.create_swapchain(&SwapchainDesc { window: Some(window.clone()), ..Default::default() }).unwrap();
    present_until_visible(&ctx, *second, &window, BLUE);
}

/// A surface that something keeps is told, as the window system may take its window.
#[test]
fn a_surface_that_a_command_buffer_keeps_is_told() {
    let Some((window, ctx)) = window() else { return };
    let desc = SwapchainDesc { debug_name: "main window", ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let recorded = fill(&ctx, image.texture(), RED).unwrap();
    for _ in 0..2 {
        let told = message(ctx.suspend_swapchain(*swapchain));
        assert!(told.contains("main window") && told.contains("not submitted"), "{told}");
    }
    drop(recorded);
    ctx.suspend_swapchain(*swapchain).unwrap();
    ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [64, 48]).unwrap();
    present_until_visible(&ctx, *swapchain, &window, GREEN);
}

/// Images that could be created keep no `VkSwapchainKHR` where one of them could not: the window takes the next try.
#[test]
fn a_swapchain_that_lacks_slots_for_its_images_leaves_nothing() {
    let Some((window, ctx)) = window_with(|desc| desc.max_textures = 8) else { return };
    let texture = || ctx.create_texture(&TextureDesc { extent: [1, 1], ..Default::default() });
    let mut textures: Vec<_> = std::iter::from_fn(|| texture().ok()).collect();
    assert_eq!(textures.len(), 7);
    // One image has a slot, and the next has none.
    textures.pop();
    ctx.wait_idle().unwrap();
    assert_eq!(waiting_objects(&ctx).unwrap(), 0);
    let taken = descriptor_slots(&ctx);
    for _ in 0..3 {
        let error = ctx.create_swapchain(&SwapchainDesc::default()).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error:?}");
        assert_eq!(descriptor_slots(&ctx), taken);
    }
    drop(textures);
    ctx.wait_idle().unwrap();
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    present_until_visible(&ctx, *swapchain, &window, GREEN);
}

/// The submission that should wait for an acquired image failed, so its semaphore stays signalled: the validation layer would report
/// another acquisition with it.
#[test]
fn the_semaphore_of_a_submission_that_failed_is_not_used_again() {
    for in_another_window in [false, true] {
        let Some((window, ctx)) = with_fault_injection(window) else { return };
        let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
        let image = ctx.next_image(*swapchain).unwrap().unwrap();
        let filled = fill(&ctx, image.texture(), RED).unwrap();
        fail_submission_after(0);
        let refused = ctx.present(filled, image);
        assert!(matches!(refused, Err(Error::OutOfDeviceMemory { .. })), "{refused:?}");
        if in_another_window {
            ctx.suspend_swapchain(*swapchain).unwrap();
            ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [64, 48]).unwrap();
        } else {
            window.resize([50, 40]);
            ctx.resize_swapchain(*swapchain, [50, 40]).unwrap();
        }
        assert!(ctx.next_image(*swapchain).unwrap().is_some());
    }
}

#[test]
fn invalid_swapchains_are_refused() {
    let Some((window, ctx)) = window() else { return };
    let refused = |desc: &SwapchainDesc<'_>| ctx.create_swapchain(desc).unwrap_err();
    let none = SwapchainDesc { usage: TextureUsage::empty(), debug_name: "bare", ..Default::default() };
    let error = refused(&none);
    assert!(matches!(error, Error::InvalidUsage { .. }), "{error:?}");
    assert!(error.to_string().contains("bare"), "{error}");
    let profile = DeviceProfile::core_only();
    let desc = ContextDesc {
        vulkan_library: vulkan().unwrap(),
        window: Some(window.clone()),
        profile: Some(&profile),
        ..Default::default()
    };
    let error = Context::new(&desc).unwrap_err();
    assert!(matches!(error, Error::NoDevice { .. }), "{error}");
    let error = error.to_string();
    assert!(error.contains("VK_KHR_swapchain (hidden by the device profile 'core-only')"), "{error}");
    // Wishes are no demands.
    let wishes = SwapchainDesc {
        color_spaces: &[ColorSpace::Hdr10, ColorSpace::ExtendedSrgbLinear],
        present_modes: &[PresentMode::Mailbox, PresentMode::Immediate],
        hdr: Some(HdrMetadata::default()),
        image_count: 1000,
        ..Default::default()
    };
    let swapchain = ctx.create_swapchain(&wishes).unwrap();
    present_color(&ctx, *swapchain, RED).unwrap();
    let handle = *swapchain;
    drop(swapchain);
    assert!(matches!(ctx.next_image(handle), Err(Error::StaleHandle { kind: "swapchain", .. })));
    assert!(matches!(ctx.swapchain_info(handle), Err(Error::StaleHandle { .. })));
    assert!(matches!(ctx.resize_swapchain(handle, [1, 1]), Err(Error::StaleHandle { .. })));
    assert!(matches!(ctx.set_present_mode(handle, &[]), Err(Error::StaleHandle { .. })));
    assert!(matches!(ctx.suspend_swapchain(handle), Err(Error::StaleHandle { .. })));
    let resumed = ctx.resume_swapchain(handle, &(window as Arc<_>), [1, 1]);
    assert!(matches!(resumed, Err(Error::StaleHandle { .. })));
}

#[test]
fn numbers_queues_and_contexts_that_do_not_fit_are_refused() {
    let Some((window, ctx)) = window_with(|desc| desc.queues = QueueRequest::Emulated) else { return };
    for hdr in [
        HdrMetadata { luminance: [f32::NAN, 1000.0], ..Default::default() },
        HdrMetadata { white_point: [0.3, f32::INFINITY], ..Default::default() },
        HdrMetadata { primaries: [[-0.1; 2]; 3], ..Default::default() },
        HdrMetadata { max_content_light_level: -1.0, ..Default::default() },
    ] {
        let desc = SwapchainDesc { hdr: Some(hdr), debug_name: "bright", ..Default::default() };
        let told = message(ctx.create_swapchain(&desc));
        assert!(told.contains("bright") && told.contains("finite numbers from 0"), "{told}");
    }
    for strange in
        [Strange::WithoutHandle, Strange::OfUnknownSystem, Strange::OfTwoSystems, Strange::WithoutConnection]
    {
        let desc = SwapchainDesc { window: strange_window::window(strange), ..Default::default() };
        expect_refused(strange, &ctx.create_swapchain(&desc).unwrap_err());
    }
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    // A window that the swapchain cannot go on in leaves it suspended, and it goes on in the next.
    for strange in [Strange::WithoutHandle, Strange::OfUnknownSystem] {
        let other = strange_window::window(strange).unwrap();
        expect_refused(strange, &ctx.resume_swapchain(*swapchain, &other, [64, 48]).unwrap_err());
        assert!(message(ctx.swapchain_info(*swapchain)).contains("suspended"), "{strange:?}");
        assert!(ctx.next_image(*swapchain).unwrap().is_none());
        ctx.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [64, 48]).unwrap();
    }
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let Some(other) = device() else { return };
    let foreign = |answer: Result<()>| {
        assert!(matches!(answer, Err(Error::ForeignHandle { kind: "swapchain" })), "{answer:?}");
    };
    foreign(other.next_image(*swapchain).map(drop));
    foreign(other.swapchain_info(*swapchain).map(drop));
    foreign(other.resize_swapchain(*swapchain, [1, 1]));
    foreign(other.set_present_mode(*swapchain, &[]));
    foreign(other.suspend_swapchain(*swapchain));
    foreign(other.resume_swapchain(*swapchain, &(window.clone() as Arc<_>), [1, 1]));
    foreign(other.present(other.acquire_command_buffer().unwrap(), image).map(drop));
    // The swapchain goes on after a refusal.
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    let told = message(ctx.present(ctx.acquire_command_buffer_on(Queue::Compute).unwrap(), image));
    assert!(told.contains("swapchain") && told.contains("belong to the graphics queue"), "{told}");
    present_until_visible(&ctx, *swapchain, &window, RED);
}

#[test]
fn images_of_a_swapchain_are_not_destroyed_alone() {
    let Some((window, ctx)) = window() else { return };
    capture_warnings();
    let desc = SwapchainDesc { debug_name: "the shown one", ..Default::default() };
    let swapchain = ctx.create_swapchain(&desc).unwrap();
    let image = ctx.next_image(*swapchain).unwrap().unwrap();
    ctx.destroy(image.texture());
    let told = take_warnings("the shown one");
    assert!(matches!(&told[..], [told] if told.contains("destroy the swapchain")), "{told:?}");
    ctx.present(fill(&ctx, image.texture(), GREEN).unwrap(), image).unwrap();
    present_until_visible(&ctx, *swapchain, &window, RED);
}
