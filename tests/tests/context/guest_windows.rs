//! Swapchains on a device of another engine.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::sync::Arc;

use lvk::*;
use lvk_tests::guest_engine::{GuestEngine, GuestInstance};
use lvk_tests::windows::{TestWindow, desktop, present_until_visible};

const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];
const GREEN: [f32; 4] = [0.0, 1.0, 0.0, 1.0];
const BLUE: [f32; 4] = [0.0, 0.0, 1.0, 1.0];

/// A description for a window of another engine's device.
fn guest_desc(window: &Arc<TestWindow>) -> ContextDesc<'static> {
    ContextDesc { window: Some(window.clone()), ..Default::default() }
}

/// Returns the field and the message of an error of `from_raw`.
fn refusal(raw: RawContext<'_>, desc: &ContextDesc<'_>) -> (String, String) {
    // SAFETY: the handles are those of an engine; what is wrong is found before anything is made.
    match unsafe { Context::from_raw(raw, desc) } {
        Err(Error::InvalidUsage { object, message }) => (object, message),
        other => unreachable!("{other:?}"),
    }
}

#[test]
fn windows_are_presented_to_on_another_engines_device() {
    let Some(desktop) = desktop() else { return };
    let (window, other) = (desktop.window([64, 48]), desktop.window([32, 32]));
    let desc = guest_desc(&window);
    let Some(engine) = GuestEngine::new(&desc) else { return };
    assert!(engine.instance().extensions.contains(&ash::khr::xcb_surface::NAME));
    let ctx = engine.context(&desc);
    assert!(ctx.capabilities().has(OptionalFeature::Swapchain));
    let swapchain = ctx.create_swapchain(&SwapchainDesc::default()).unwrap();
    let second = SwapchainDesc { window: Some(other.clone()), ..Default::default() };
    let second = ctx.create_swapchain(&second).unwrap();
    for color in [RED, GREEN] {
        present_until_visible(&ctx, *swapchain, &window, color);
        present_until_visible(&ctx, *second, &other, color);
    }
    window.resize([50, 40]);
    present_until_visible(&ctx, *swapchain, &window, BLUE);
}

#[test]
fn another_engines_device_without_swapchains_is_told_what_is_missing() {
    let Some(desktop) = desktop() else { return };
    let window = desktop.window([16, 16]);
    let desc = guest_desc(&window);
    let Some(engine) = GuestEngine::new(&desc) else { return };
    let (object, message) = refusal(RawContext { instance_extensions: &[], ..engine.raw() }, &desc);
    assert_eq!(object, "RawContext::instance_extensions");
    assert!(message.contains("VK_KHR_surface is missing"), "{message}");
    let hidden: FeatureSet =
        [OptionalFeature::Swapchain, OptionalFeature::SwapchainMaintenance1, OptionalFeature::HdrMetadata]
            .into_iter()
            .collect();
    let features = engine.raw().features.without(hidden);
    let raw = RawContext { features, instance_extensions: &[ash::khr::surface::NAME], ..engine.raw() };
    let (object, message) = refusal(raw, &desc);
    assert_eq!(object, "RawContext::instance_extensions");
    assert!(message.contains("VK_KHR_xcb_surface is missing; ContextDesc::window"), "{message}");
    let (object, message) = refusal(RawContext { features, ..engine.raw() }, &desc);
    assert_eq!(object, "RawContext::features");
    assert!(message.contains("VK_KHR_swapchain is missing; ContextDesc::window"), "{message}");
    drop(engine);

    // Neither the instance nor the device of this engine presents.
    let none = ContextDesc::default();
    let Some(engine) = GuestEngine::new(&none) else { return };
    let ctx = engine.context(&none);
    let windowed = SwapchainDesc { window: Some(window), ..Default::default() };
    match ctx.create_swapchain(&windowed) {
        Err(Error::Unsupported { why, .. }) => assert!(why.contains("VK_KHR_swapchain"), "{why}"),
        other => unreachable!("{other:?}"),
    }
    drop(ctx);
    let Some(instance) = GuestInstance::new(&none) else { return };
    match instance.requirements(&desc) {
        Err(Error::InvalidUsage { object, message }) => {
            assert_eq!(object, "instance_extensions");
            assert!(message.contains("VK_KHR_surface is missing"), "{message}");
        }
        other => unreachable!("{other:?}"),
    }
}

/// The instance has surfaces, but not those of the window system.
#[test]
fn another_engines_instance_for_another_window_system_is_refused() {
    let Some(desktop) = desktop() else { return };
    let desc = guest_desc(&desktop.window([16, 16]));
    let Some(engine) = GuestEngine::new(&desc) else { return };
    let none = ContextDesc::default();
    let raw = RawContext {
        features: engine
            .raw()
            .features
            .without(FeatureSet::NONE.with(OptionalFeature::SwapchainMaintenance1)),
        instance_extensions: &[ash::khr::surface::NAME],
        ..engine.raw()
    };
    // SAFETY: the device has more on than the description says, and outlives the context.
    let ctx = unsafe { Context::from_raw(raw, &none) }.unwrap();
    match ctx.create_swapchain(&SwapchainDesc { window: desc.window.clone(), ..Default::default() }) {
        Err(Error::Unsupported { why, .. }) => assert!(why.contains("VK_KHR_xcb_surface"), "{why}"),
        other => unreachable!("{other:?}"),
    }
}
