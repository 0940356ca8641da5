//! The page on porting from LightweightVK translates every call of its two interfaces.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use crate::held_by::project;

/// The calls of `IContext` and `ICommandBuffer`, in August 2026.
const CALLS: &str = "acquireCommandBuffer cmdBeginRendering cmdBindComputePipeline cmdBindDepthState \
    cmdBindIndexBuffer cmdBindRayTracingPipeline cmdBindRenderPipeline cmdBindScissorRect cmdBindVertexBuffer \
    cmdBindViewport cmdClearColorImage cmdCopyBuffer cmdCopyImage cmdDispatch cmdDispatchIndirect cmdDraw \
    cmdDrawIndexed cmdDrawIndexedIndirect cmdDrawIndexedIndirectCount cmdDrawIndirect cmdDrawMeshTasks \
    cmdDrawMeshTasksIndirect cmdDrawMeshTasksIndirectCount cmdEndRendering cmdFillBuffer cmdGenerateMipmap \
    cmdInsertDebugEventLabel cmdNextSubpass cmdPopDebugGroupLabel cmdPushConstants cmdPushDebugGroupLabel \
    cmdResetQueryPool cmdSetBlendColor cmdSetDepthBias cmdSetDepthBiasEnable cmdSetFragmentShadingRate \
    cmdTraceRays cmdTransitionToGeneral cmdTransitionToRenderingLocalRead cmdTransitionToShaderReadOnly \
    cmdUpdateBuffer cmdUpdateTLAS cmdWriteTimestamp createAccelerationStructure createBuffer \
    createComputePipeline createQueryPool createRayTracingPipeline createRenderPipeline createSampler \
    createShaderModule createTexture createTextureView destroy download flushMappedMemory getAccelStructSizes \
    getAspectRatio getCurrentPresentMode getCurrentSwapchainTexture getDimensions getFormat \
    getFramebufferMSAABitMask getMappedPtr getMaxStorageBufferRange getNumSwapchainImages getQueryPoolResults \
    getSwapchainColorSpace getSwapchainCurrentImageIndex getSwapchainFormat getTimestampPeriodToMs gpuAddress \
    isExtensionEnabled recreateSwapchain setCurrentPresentMode submit supportsAsyncCompute upload wait";

#[test]
fn every_call_of_lightweightvk_is_translated() {
    let page = project().join("lvk/src/manual/from_lightweightvk.md");
    let page = std::fs::read_to_string(page).unwrap();
    let (_, tables) = page.split_once("\n# Calls\n").unwrap();
    let (tables, _) = tables.split_once("\n# Samples\n").unwrap();
    let left = tables.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
    let left: String = left.map(|(call, _)| format!("{call}\n")).collect();
    let absent: Vec<_> =
        CALLS.split_whitespace().filter(|call| !left.contains(&format!("`{call}`"))).collect();
    assert!(absent.is_empty(), "not translated: {absent:?}");
}

#[test]
fn every_page_of_the_manual_has_rust_that_compiles() {
    let folder = project().join("lvk/src/manual");
    let mut pages = 0;
    for page in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if page.extension().is_none_or(|extension| extension != "md") {
            continue;
        }
        let text = std::fs::read_to_string(&page).unwrap();
        let has_rust = [
            "\n```\nuse lvk::",
            "\n```no_run\nuse lvk::",
            "\n```no_run\n# use lvk::",
            "\n```no_run\nuse std::",
        ];
        assert!(has_rust.iter().any(|start| text.contains(start)), "{} has no Rust", page.display());
        pages += 1;
    }
    assert!(pages >= 16, "{pages} pages");
}

/// Runs of documentation tests need a device, so those that only compile are few.
#[test]
fn most_documentation_tests_run() {
    let folder = project().join("lvk/src/manual");
    let (mut run, mut compiled) = (0, 0);
    for page in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        let text = std::fs::read_to_string(page).unwrap();
        // Blocks of other languages name theirs.
        let starts =
            text.split("\n```").skip(1).step_by(2).map(|block| block.lines().next().unwrap_or_default());
        for start in starts {
            run += usize::from(start.is_empty());
            compiled += usize::from(start == "no_run");
        }
    }
    assert!(run + compiled >= 60 && run > compiled, "{run} run, {compiled} only compile");
}

/// The page on interoperation shows the lines of the sample, which is compiled and tested.
#[test]
fn the_code_for_wgpu_is_that_of_the_sample() {
    let read = |path: &str| std::fs::read_to_string(project().join(path)).unwrap();
    let page = read("lvk/src/manual/interop.md");
    let sample = read("samples/wgpu-guest/src/device.rs");
    let (_, code) = page.split_once("```rust,ignore\n").unwrap();
    let (code, _) = code.split_once("\n```").unwrap();
    let mut lines = sample.lines().map(str::trim);
    for line in code.lines().map(str::trim).filter(|line| !line.is_empty()) {
        assert!(lines.any(|other| other == line), "the sample has no line '{line}' at this place");
    }
    assert!(code.lines().count() > 30);
}
