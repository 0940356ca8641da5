//! Tests of reflection and of the passes over modules.

use ::spirv::{Capability, Decoration, Op};

use super::*;

#[test]
fn used_arrays_survive_the_removal_of_unused_ones() {
    let words = words(
        ShaderStage::Compute,
        &shader(ShaderStage::Compute, "", "imageStore(kImages2D[3], ivec2(0), vec4(1));"),
    );
    assert!(declares(&words, "kImages2D"));
    assert!(!declares(&words, "kImages3D"));
    assert_eq!(reflect("test", ShaderStage::Compute, &words).unwrap().bindings, [2]);
}

#[test]
fn removal_leaves_no_loose_ends() {
    for stage in ShaderStage::ALL {
        let words = words(stage, &shader(stage, GLOBALS, HELPERS));
        let all: Vec<_> = words::instructions(&words).map(|i| i.unwrap()).collect();
        let variables: Vec<u32> =
            all.iter().filter(|i| i.op == Some(Op::Variable)).map(|i| i.operand(1)).collect();
        let entry = all.iter().find(|i| i.op == Some(Op::EntryPoint)).unwrap();
        let interface = &entry.operands()[2 + entry.string(2).1..];
        assert!(interface.iter().all(|id| variables.contains(id)), "{stage:?}");
        let bound =
            all.iter().filter(|i| i.op == Some(Op::Decorate) && i.operand(1) == Decoration::Binding as u32);
        for decorate in bound {
            assert!(variables.contains(&decorate.operand(0)), "{stage:?}");
        }
    }
}

#[test]
fn sampled_operands_are_marked_non_uniform() {
    let text = shader(ShaderStage::Compute, "", "uint i = gl_LocalInvocationIndex;
        imageStore(kImages2D[0], ivec2(0), textureBindless2D(i, i, vec2(0)) + textureBindlessFetch2D(i, ivec2(0), 0));");
    let words = words(ShaderStage::Compute, &text);
    let all: Vec<_> = words::instructions(&words).map(|i| i.unwrap()).collect();
    let non_uniform = |id: u32| {
        let marks = |i: &&words::Instruction<'_>| {
            i.op == Some(Op::Decorate) && i.operand(1) == Decoration::NonUniform as u32
        };
        all.iter().filter(marks).any(|i| i.operand(0) == id)
    };
    for op in [Op::ImageSampleExplicitLod, Op::ImageFetch] {
        let image = all.iter().find(|i| i.op == Some(op)).unwrap().operand(2);
        assert!(non_uniform(image), "{op:?}");
        // The decoration must not be on a copy of a loaded or combined value: SwiftShader ignores it there.
        let is_maker = |i: &&words::Instruction<'_>| matches!(i.op, Some(Op::SampledImage | Op::Load));
        assert!(all.iter().filter(is_maker).any(|i| i.operand(1) == image), "{op:?}");
    }
}

#[test]
fn formatless_reads_follow_the_device() {
    let text = shader(
        ShaderStage::Compute,
        "",
        "imageStore(kImages2D[1], ivec2(0), imageLoad(kImages2D[0], ivec2(0)));",
    );
    let read = CompileOptions { formatless_read: true, ..Default::default() };
    let words = compile(&desc(ShaderStage::Compute, &text), &read, CompileFiles::default()).unwrap();
    assert!(capabilities(&words).contains(&(Capability::StorageImageReadWithoutFormat as u32)));
    assert!(error(ShaderStage::Compute, &text).contains("writeonly"));
}

#[test]
fn push_constants_are_measured_by_their_layout() {
    let bytes = |layout: &str, block: &str| {
        let globals = format!(
            "layout(buffer_reference) buffer Node;\nlayout(buffer_reference, scalar) buffer Node {{ Node next; float v; }};\nstruct S {{ vec3 a; float b; vec3 c; }};\n\
             layout(push_constant, {layout}) uniform Push {{ {block} }} push;"
        );
        let body = "imageStore(kImages2D[0], ivec2(0), vec4(push.last));";
        facts(ShaderStage::Compute, &shader(ShaderStage::Compute, &globals, body)).push_constant_bytes
    };
    assert_eq!(bytes("scalar", "vec3 a; float last;"), 16);
    assert_eq!(bytes("std430", "float a; vec3 b; float last;"), 32);
    assert_eq!(bytes("scalar", "float a; vec3 b; float last;"), 20);
    assert_eq!(bytes("scalar", "uint a; Node node; float last;"), 20);
    assert_eq!(bytes("std430", "float last; Node node;"), 16);
    assert_eq!(bytes("scalar", "float last; vec3 a[3];"), 40);
    assert_eq!(bytes("std430", "float last; vec3 a[3];"), 64);
    assert_eq!(bytes("scalar", "float last; S s[2];"), 60);
    assert_eq!(bytes("std430", "float last; S s;"), 44);
    assert_eq!(bytes("scalar", "float last; mat3 m; mat4x3 n;"), 88);
    assert_eq!(bytes("std430", "mat3 m; float last;"), 52);
    assert_eq!(bytes("std430", "float last; mat4 m[2];"), 144);
    assert_eq!(bytes("scalar", "float last; layout(row_major) mat4x3 m;"), 52);
    assert_eq!(bytes("scalar", "float last; uint64_t address; uint8_t small;"), 20);
    assert_eq!(bytes("scalar", "layout(offset = 64) float last;"), 68);
    assert_eq!(facts(ShaderStage::Compute, "void main() {}").push_constant_bytes, 0);
}

#[test]
fn work_group_sizes_and_specialization_are_reported() {
    let plain = facts(ShaderStage::Compute, "layout(local_size_x = 8, local_size_y = 4) in; void main() {}");
    assert_eq!((plain.local_size, plain.local_size_ids), ([8, 4, 1], [None; 3]));
    let text = "layout(local_size_x = 8, local_size_x_id = 3) in; layout(constant_id = 1) const bool on = true;\n\
                layout(constant_id = 9) const double big = 1.0; layout(constant_id = 2) const uint n = 4;\n\
                void main() { if (on) imageStore(kImages2D[n], ivec2(gl_WorkGroupSize.x), vec4(float(big))); }";
    let found = facts(ShaderStage::Compute, text);
    assert_eq!((found.local_size, found.local_size_ids), ([8, 1, 1], [Some(3), None, None]));
    assert_eq!(found.specialization, [(1, 4), (2, 4), (3, 4), (9, 8)]);
    let mesh = shader(ShaderStage::Mesh, "", "SetMeshOutputsEXT(0u, 0u);");
    let mesh = facts(ShaderStage::Mesh, &mesh);
    assert_eq!((mesh.local_size, mesh.mesh_outputs), ([32, 1, 1], [3, 1]));
    let fragment = facts(ShaderStage::Fragment, "void main() {}");
    assert_eq!((fragment.local_size, fragment.mesh_outputs), ([0; 3], [0; 2]));
}

#[test]
fn foreign_bindings_are_refused_with_the_remedy() {
    let refuse = |declaration: &str, uses: &str| {
        let text = shader(ShaderStage::Fragment, declaration, &format!("colour = {uses};"));
        let words = words(ShaderStage::Fragment, &format!("layout(location = 0) out vec4 colour;\n{text}"));
        log(reflect("test", ShaderStage::Fragment, &words))
    };
    let found =
        refuse("layout(set = 1, binding = 3) uniform texture2D albedo;", "texelFetch(albedo, ivec2(0), 0)");
    assert!(
        found.contains("'albedo' is in set 1, binding 3; resources live in set 0 at bindings 0 sampled"),
        "{found}"
    );
    let found = refuse("layout(set = 0, binding = 0) uniform sampler2D both;", "texture(both, vec2(0))");
    assert!(found.contains("binding 0, which holds sampled images"), "{found}");
    let found = refuse("layout(set = 0, binding = 7) uniform texture2D t;", "texelFetch(t, ivec2(0), 0)");
    assert!(found.contains("binding 7, which does not exist"), "{found}");
    let found = refuse("layout(set = 0, binding = 0) uniform Block { vec4 c; } block;", "block.c");
    assert!(found.contains("buffer_reference"), "{found}");
    let found = refuse("layout(set = 0, binding = 2) buffer Block { vec4 c; } block;", "block.c");
    assert!(found.contains("buffer_reference"), "{found}");
    let found = refuse("layout(set = 0, binding = 0) uniform textureBuffer t;", "texelFetch(t, 0)");
    assert!(found.contains("which holds sampled images"), "{found}");
}

#[test]
fn the_entry_point_must_match_the_stage() {
    let words = words(ShaderStage::Fragment, "void main() {}");
    let found = log(reflect("test", ShaderStage::Compute, &words));
    assert_eq!(found, "no entry point 'main' for the compute stage; the module has 'main' (fragment)");
}

#[test]
fn spirv_words_are_checked() {
    let good = words(ShaderStage::Compute, "void main() {}");
    let take = |words: &[u32]| {
        build(&ShaderModuleDesc { source: ShaderSource::Spirv(words), ..desc(ShaderStage::Compute, "") })
    };
    assert_eq!(take(&good).unwrap(), good);
    assert!(log(take(&[])).contains("magic number"));
    assert!(log(take(&good[..3])).contains("header"));
    assert!(log(take(&good[..good.len() - 1])).contains("ends inside a function"));
    assert!(log(take(&good[..good.len() - 3])).contains("cut off"));
    let swapped: Vec<u32> = good.iter().map(|word| word.swap_bytes()).collect();
    assert!(log(take(&swapped)).contains("byte order"));
    let mut newer = good;
    newer[1] = 0x0001_0700;
    assert!(log(take(&newer)).contains("newer than 1.6"));
}
