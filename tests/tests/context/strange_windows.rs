//! Windows that have no handle, whose handles do not belong together, or of a window system that Vulkan does not know.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{Context, ContextDesc};
use lvk_tests::device::vulkan;
use lvk_tests::guest_engine::GuestInstance;
use lvk_tests::strange_window::{Strange, expect_refused, window};

#[test]
fn contexts_for_strange_windows_are_refused() {
    let Some(library) = vulkan() else { return };
    for strange in [
        Strange::WithoutHandle,
        Strange::OfUnknownSystem,
        #[cfg(target_os = "linux")]
        Strange::OfTwoSystems,
        #[cfg(target_os = "linux")]
        Strange::WithoutConnection,
    ] {
        let desc = ContextDesc { vulkan_library: library, window: window(strange), ..Default::default() };
        expect_refused(strange, &Context::new(&desc).unwrap_err());
    }
}

#[test]
fn instances_for_strange_windows_are_refused() {
    let Some(instance) = GuestInstance::new(&ContextDesc::default()) else { return };
    for strange in [Strange::WithoutHandle, Strange::OfUnknownSystem] {
        let desc = ContextDesc { window: window(strange), ..Default::default() };
        expect_refused(strange, &Context::instance_requirements(&instance.entry, &desc).unwrap_err());
    }
}
