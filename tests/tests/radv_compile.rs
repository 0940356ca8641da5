//! Every pipeline of the library and of the samples compiles for AMD GPUs, without such a GPU in the machine.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::Path;

use lvk::{Context, ContextDesc, ShaderStage};
use lvk_samples::pipelines::{SamplePipeline, SampleStage};
use lvk_tests::device::vulkan;
use lvk_tests::pipelines;
use lvk_tests::radv::Radv;
use lvk_tests::subprocess::on_radv;

/// The compute shaders that the library runs by itself.
const KERNELS: [(&str, &str); 3] = [
    ("gather", include_str!("../../lvk/src/kernels/gather.comp.glsl")),
    ("instances", include_str!("../../lvk/src/kernels/instances.comp.glsl")),
    ("trace_size", include_str!("../../lvk/src/kernels/trace_size.comp.glsl")),
];

fn kernels() -> impl Iterator<Item = SamplePipeline> {
    KERNELS.into_iter().map(|(name, text)| {
        let stage = SampleStage { stage: ShaderStage::Compute, text, defines: &[], name };
        SamplePipeline { name, stages: vec![stage], color: Vec::new(), depth: None }
    })
}

/// The text of a constant in the program of the `triangle` sample.
fn triangle_text(constant: &str) -> &'static str {
    const PROGRAM: &str = include_str!("../../samples/src/bin/triangle.rs");
    let (_, rest) = PROGRAM.split_once(&format!("const {constant}: &str = r\"")).unwrap();
    rest.split_once("\";").unwrap().0
}

fn triangle() -> SamplePipeline {
    let stages =
        [(ShaderStage::RayGen, "RAY_GEN"), (ShaderStage::Miss, "MISS"), (ShaderStage::ClosestHit, "HIT")];
    let stage = |(stage, name)| SampleStage { stage, text: triangle_text(name), defines: &[], name };
    let stages = stages.map(stage).to_vec();
    SamplePipeline { name: "triangle", stages, color: Vec::new(), depth: None }
}

/// Compiles everything for the chip and expects programs with instructions: one for each stage, or one for all stages
/// that trace rays, as the driver puts them into one where it can.
fn compile_all(chip: &str) {
    let radv = Radv::open();
    assert!(radv.capabilities.device_name.contains(chip), "{:?}", radv.capabilities);
    assert!(radv.capabilities.ray_query && radv.capabilities.ray_tracing_pipeline);
    let shipped: Vec<_> = pipelines::all().into_iter().chain([triangle()]).chain(kernels()).collect();
    assert!(shipped.len() >= 8);
    for pipeline in shipped {
        let programs = radv.compile(&pipeline);
        println!("{chip}, {}: {programs:?}", pipeline.name);
        let expected = if pipeline.color.is_empty() { 1 } else { pipeline.stages.len() };
        assert!(programs.len() >= expected, "{}: {programs:?}", pipeline.name);
        assert!(programs.values().all(|instructions| *instructions > 0), "{}: {programs:?}", pipeline.name);
    }
}

#[test]
fn every_kernel_of_the_library_is_compiled() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../lvk/src/kernels");
    let mut texts = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.to_string_lossy().ends_with(".comp.glsl") {
            texts.push(std::fs::read_to_string(path).unwrap());
        }
    }
    assert_eq!(texts.len(), KERNELS.len());
    assert!(KERNELS.iter().all(|(_, text)| texts.iter().any(|found| found == text)));
}

#[test]
fn shipped_pipelines_compile_for_rdna_2() {
    on_radv(shipped_pipelines_compile_for_rdna_2, "navi21", || compile_all("NAVI21"));
}

#[test]
fn shipped_pipelines_compile_for_rdna_3() {
    on_radv(shipped_pipelines_compile_for_rdna_3, "navi31", || compile_all("NAVI31"));
}

#[test]
fn shipped_pipelines_compile_for_rdna_4() {
    on_radv(shipped_pipelines_compile_for_rdna_4, "gfx1201", || compile_all("GFX1201"));
}

#[test]
fn a_device_without_memory_is_an_error() {
    on_radv(a_device_without_memory_is_an_error, "navi31", || {
        let library: Option<&Path> = vulkan().flatten();
        let context = Context::new(&ContextDesc { vulkan_library: library, ..Default::default() });
        assert!(context.is_err());
    });
}
