//! Shader modules: errors name the user's own lines, SPIR-V is accepted and checked, bindings and stages must match.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ComputePipelineDesc, Context, Dependencies, DeviceProfile, Error, ShaderModuleDesc, ShaderSource,
    ShaderStage, SpecializationConstant, SpecializationValue, compile_glsl,
};
use lvk_tests::compute::{compute_pipeline, module, read_words, words_buffer};
use lvk_tests::{device, device_with};

/// The error of GLSL that must not compile.
fn refused(ctx: &Context, desc: &ShaderModuleDesc<'_>) -> String {
    match ctx.create_shader_module(&ShaderModuleDesc { debug_name: "odd one", ..*desc }) {
        Err(Error::Shader { name, log }) => {
            assert_eq!(name, "odd one");
            log
        }
        other => unreachable!("{other:?}"),
    }
}

fn compute(text: &str) -> ShaderModuleDesc<'_> {
    ShaderModuleDesc { stage: ShaderStage::Compute, source: ShaderSource::Glsl(text), ..Default::default() }
}

#[test]
fn errors_carry_the_line_of_the_text() {
    let Some(ctx) = device() else { return };
    let log =
        refused(&ctx, &compute("layout(local_size_x = 1) in;\nvoid main() {\n    uint a = nowhere;\n}"));
    assert!(log.starts_with("line 3: ") && log.contains("nowhere"), "{log}");
    let log = refused(&ctx, &compute("#version 460\n\n\nvoid main() { oops }"));
    assert!(log.starts_with("line 4: "), "{log}");
    let log = refused(&ctx, &compute("#version 330\nvoid main() {}"));
    assert!(log.starts_with("line 1: ") && log.contains("330"), "{log}");
    let log = refused(&ctx, &compute("void main() {}\n// fine\nint \u{e9};"));
    assert!(log.starts_with("line 3: "), "{log}");
    refused(&ctx, &compute(""));
}

#[test]
fn errors_in_includes_carry_their_file_and_line() {
    let Some(ctx) = device() else { return };
    let text = "layout(local_size_x = 1) in;\n#include \"parts/outer.glsl\"\nvoid main() { outer(); }";
    let outer = "#pragma once\n#include \"inner.glsl\"\nvoid outer() { inner(); }";
    let good = [("parts/outer.glsl", outer), ("parts/inner.glsl", "void inner() {}")];
    let desc = ShaderModuleDesc { includes: &good, ..compute(text) };
    drop(ctx.create_shader_module(&desc).unwrap());
    let bad = [good[0], ("parts/inner.glsl", "// a comment\n\nvoid inner() { nowhere(); }")];
    let log = refused(&ctx, &ShaderModuleDesc { includes: &bad, ..compute(text) });
    assert!(log.contains("parts/inner.glsl:3: ") && log.contains("nowhere"), "{log}");
    let log = refused(&ctx, &ShaderModuleDesc { includes: &good[..1], ..compute(text) });
    assert!(log.contains("inner.glsl") && log.contains("not found"), "{log}");
    let after = "#include \"parts/outer.glsl\"\nvoid main() {\nnowhere(); }";
    let log = refused(&ctx, &ShaderModuleDesc { includes: &good, ..compute(after) });
    assert!(log.starts_with("line 3: "), "{log}");
}

#[test]
fn includes_come_from_folders_too() {
    let Some(ctx) = device() else { return };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("value.glsl"), "const uint kValue = 41;\n").unwrap();
    let text = "
        #include <value.glsl>
        layout(local_size_x = 1) in;
        layout(buffer_reference, scalar) writeonly buffer Result { uint at; };
        layout(push_constant, scalar) uniform Push { Result result; };
        void main() { result.at = kValue + MORE; }";
    let dirs = [folder.path()];
    let desc = ShaderModuleDesc { include_dirs: &dirs, defines: &[("MORE", "1")], ..compute(text) };
    let module = ctx.create_shader_module(&desc).unwrap();
    let pipeline = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&pipeline).unwrap();
    let result = words_buffer(&ctx, &[0]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*result).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *result, 1), [42]);
}

const MAGIC: u32 = 0x0723_0203;

/// `void main() {}` as a compute shader of one invocation.
const EMPTY: [u32; 37] = [
    MAGIC,
    0x0001_0300,
    0,
    5,
    0,
    op(2, 17),
    1,
    op(3, 14),
    0,
    1,
    op(5, 15),
    5,
    1,
    u32::from_le_bytes(*b"main"),
    0,
    op(6, 16),
    1,
    17,
    1,
    1,
    1,
    op(2, 19),
    2,
    op(3, 33),
    3,
    2,
    op(5, 54),
    2,
    1,
    0,
    3,
    op(2, 248),
    4,
    op(1, 253),
    op(1, 56),
    op(1, 0),
    op(1, 0),
];

/// First word of an instruction: how many words it has, and which it is.
const fn op(words: u32, code: u32) -> u32 {
    words << 16 | code
}

fn spirv(words: &[u32]) -> ShaderModuleDesc<'_> {
    ShaderModuleDesc { stage: ShaderStage::Compute, source: ShaderSource::Spirv(words), ..Default::default() }
}

#[test]
fn spirv_words_are_taken_as_they_are() {
    let Some(ctx) = device() else { return };
    let module = ctx.create_shader_module(&spirv(&EMPTY[..35])).unwrap();
    let pipeline = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&pipeline).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap();
    let done = ctx.submit(cmd).unwrap();
    ctx.wait(done).unwrap();
}

#[test]
fn damaged_spirv_is_an_error() {
    let Some(ctx) = device() else { return };
    let good = &EMPTY[..35];
    for length in 0..good.len() {
        let made = ctx.create_shader_module(&spirv(&good[..length]));
        assert!(matches!(made, Err(Error::Shader { .. })), "the first {length} words: {made:?}");
    }
    let with = |at: usize, word: u32| {
        let mut words = good.to_vec();
        words[at] = word;
        refused(&ctx, &spirv(&words))
    };
    assert!(with(0, MAGIC.swap_bytes()).contains("byte order"));
    assert!(with(0, 0).contains("magic"));
    assert!(with(1, 0x0001_0700).contains("1.6"));
    assert!(with(13, u32::from_le_bytes(*b"mine")).contains("mine"));
    for at in [5, 7, 10, 15, 26] {
        with(at, good[at] & 0xffff);
        with(at, good[at] | 0xffff_0000);
    }
}

#[test]
fn the_stage_of_a_module_must_be_the_stage_it_is_used_in() {
    let Some(ctx) = device() else { return };
    let vertex = ShaderModuleDesc { stage: ShaderStage::Vertex, ..spirv(&EMPTY[..35]) };
    let log = refused(&ctx, &vertex);
    assert!(log.contains("vertex") && log.contains("compute"), "{log}");
    let vertex = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(0); }");
    let desc = ComputePipelineDesc { module: Some(*vertex), ..Default::default() };
    let error = ctx.create_compute_pipeline(&desc).map(drop).unwrap_err();
    assert!(
        error.to_string().contains("a Compute module is needed here, this is a Vertex module"),
        "{error}"
    );
    let error = ctx.create_compute_pipeline(&ComputePipelineDesc::default()).map(drop).unwrap_err();
    assert!(matches!(&error, Error::InvalidUsage { object, .. } if object == "compute pipeline"), "{error}");
    assert!(error.to_string().contains("give the pipeline a compute shader"), "{error}");
}

#[test]
fn descriptors_of_the_users_own_are_refused() {
    let Some(ctx) = device() else { return };
    let refuse = |declaration: &str, use_: &str, words: &str| {
        let text = format!(
            "layout(local_size_x = 1) in;\n{declaration}\nshared vec4 sum;\nvoid main() {{ sum = vec4({use_}); }}"
        );
        let log = refused(&ctx, &compute(&text));
        assert!(log.contains("'mine'") && log.contains(words), "{log}");
    };
    let fetch = "texelFetch(mine, ivec2(0), 0)";
    refuse("layout(set = 1, binding = 0) uniform texture2D mine;", fetch, "set 1");
    refuse("layout(set = 0, binding = 9) uniform texture2D mine;", fetch, "does not exist");
    refuse("layout(set = 0, binding = 1) uniform texture2D mine;", fetch, "which holds samplers");
    let block = "layout(set = 0, binding = 0) buffer Block { vec4 at; } mine;";
    refuse(block, "mine.at", "buffer_reference");
}

#[test]
fn dispatches_are_checked() {
    let Some(ctx) = device() else { return };
    let pipeline = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let error = cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap_err();
    assert!(matches!(error, Error::InvalidUsage { .. }), "{error:?}");
    assert!(error.to_string().contains("bind a compute pipeline first"), "{error}");
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let most = ctx.capabilities().limits.max_dispatch_workgroups;
    for axis in (0..3).filter(|axis| most[*axis] < u32::MAX) {
        let mut groups = [1; 3];
        groups[axis] = most[axis] + 1;
        let result = cmd.dispatch(groups, &Dependencies::default());
        assert!(matches!(result, Err(Error::LimitExceeded { .. })), "{groups:?}: {result:?}");
    }
    cmd.dispatch([0, 1, 1], &Dependencies::default()).unwrap();
    ctx.submit(cmd).unwrap();
}

/// Only the device knows this error: more invocations than it supports.
#[test]
fn work_groups_over_the_limit_are_refused() {
    let Some(ctx) = device() else { return };
    let module = module(
        &ctx,
        ShaderStage::Compute,
        "layout(local_size_x = 4096, local_size_y = 64) in; void main() {}",
    );
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let made = ctx.create_compute_pipeline(&desc);
    assert!(matches!(made, Err(Error::LimitExceeded { .. })), "{made:?}");
}

/// As on phones, by a profile; a constant of the pipeline may make the memory larger.
#[test]
fn shared_memory_over_the_limit_is_refused() {
    let phone = DeviceProfile { max_shared_bytes: 16 << 10, ..DeviceProfile::default() };
    let Some(ctx) = device_with(|desc| desc.profile = Some(&phone)) else { return };
    let module = module(
        &ctx,
        ShaderStage::Compute,
        "layout(local_size_x = 8) in;
        layout(constant_id = 1) const uint kVectors = 4;
        shared vec4 vectors[kVectors];
        void main() {
            vectors[gl_LocalInvocationIndex] = vec4(1);
            barrier();
            imageStore(kImages2D[0], ivec2(0), vectors[7u - gl_LocalInvocationIndex]);
        }",
    );
    let make = |vectors: u32| {
        let constants = [SpecializationConstant { id: 1, value: SpecializationValue::U32(vectors) }];
        let desc =
            ComputePipelineDesc { module: Some(*module), specialization: &constants, ..Default::default() };
        ctx.create_compute_pipeline(&desc).map(drop)
    };
    make(1_024).unwrap();
    match make(1_025) {
        Err(Error::LimitExceeded { requested, limit, .. }) => {
            assert_eq!((requested, limit), (16_400, 16_384))
        }
        other => unreachable!("{other:?}"),
    }
    let most = ctx.capabilities().limits.max_shared_bytes;
    assert_eq!(most, 16_384, "every device shares so much");
}

#[test]
fn texts_compiled_without_a_context_have_the_same_errors() {
    let Some(ctx) = device() else { return };
    let compile = |desc: &ShaderModuleDesc<'_>| match compile_glsl(
        &ShaderModuleDesc { debug_name: "odd one", ..*desc },
        ctx.capabilities(),
    ) {
        Err(Error::Shader { name, log }) => {
            assert_eq!(name, "odd one");
            log
        }
        other => unreachable!("{other:?}"),
    };
    let good = "layout(local_size_x = 1) in;\nvoid main() {}";
    for text in ["", "void main() {\n    nowhere;\n}", "#version 330\nvoid main() {}", "int \u{e9};", "\0"] {
        assert_eq!(compile(&compute(text)), refused(&ctx, &compute(text)), "{text:?}");
    }
    for define in [("", "1"), ("A B", "1"), ("A\0", "1"), ("A", "1\n#error no"), ("A", "\0"), ("9", "1")] {
        let desc = ShaderModuleDesc { defines: &[define], ..compute(good) };
        let log = compile(&desc);
        assert!(log.starts_with("define '"), "{define:?}: {log}");
        assert_eq!(refused(&ctx, &desc), log);
    }
    assert!(compile_glsl(&compute(good), ctx.capabilities()).is_ok());
}
