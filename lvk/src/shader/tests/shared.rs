//! Tests of the sizes of shared memory of workgroups.

use super::super::SharedBytes;
use super::*;

/// Returns the bytes of the shared variables with these constants; the shader uses `v`.
fn bytes(globals: &str, constants: &[(u32, u32)]) -> u64 {
    let text = format!(
        "layout(local_size_x = 8) in;\nlayout(constant_id = 1) const uint kN = 4;\nlayout(constant_id = 2) const bool kMany = true;\n\
         layout(constant_id = 3) const int kM = -3;\n{globals}\nvoid main() {{ use(); }}"
    );
    let found = facts(ShaderStage::Compute, &text).shared_memory.bytes(&constants.iter().copied().collect());
    assert_eq!(found.payload, 0);
    found.shared
}

fn plain(declarations: &str, uses: &str) -> u64 {
    let globals =
        format!("{declarations}\nvoid use() {{ imageStore(kImages2D[0], ivec2(0), vec4({uses})); }}");
    bytes(&globals, &[])
}

fn sized(length: &str, constants: &[(u32, u32)]) -> u64 {
    bytes(
        &format!("shared uint v[{length}];\nvoid use() {{ v[gl_LocalInvocationIndex % 2u] = 1u; }}"),
        constants,
    )
}

#[test]
fn shared_variables_lie_one_after_the_other_by_the_rules_of_std430() {
    assert_eq!(plain("", "1"), 0);
    assert_eq!(plain("shared float v;", "v"), 4);
    assert_eq!(plain("shared bool v[3];", "v[0]"), 12);
    assert_eq!(plain("shared double v; shared float w;", "float(v) + w"), 12);
    assert_eq!(plain("shared float v; shared vec3 w;", "v + w.x"), 28);
    assert_eq!(plain("shared vec3 v[5];", "v[0].x"), 80);
    assert_eq!(plain("shared mat3 v;", "v[0][0]"), 48);
    assert_eq!(plain("shared mat4x2 v[2][3];", "v[0][0][0][0]"), 192);
    assert_eq!(plain("struct S { vec2 a; float b; }; shared S v[4];", "v[0].b"), 64);
    assert_eq!(
        plain("struct S { float a; vec4 b; bool c; }; struct T { S s[2]; float d; }; shared T v;", "v.d"),
        112
    );
    assert_eq!(plain("shared uint8_t v[5]; shared f16vec3 w;", "float(v[0]) + float(w.x)"), 14);
    assert_eq!(
        plain(
            "layout(buffer_reference) buffer B { float x; }; struct S { float f; B b; }; shared S v;",
            "v.f"
        ),
        16
    );
}

#[test]
fn lengths_follow_the_constants_of_the_pipeline() {
    assert_eq!(sized("kN", &[]), 16);
    assert_eq!(sized("kN", &[(1, 100)]), 400);
    assert_eq!(sized("kN", &[(9, 100)]), 16);
    assert_eq!(sized("2u * kN + 8u / kN", &[]), 40);
    assert_eq!(sized("2u * kN + 8u / kN", &[(1, 8)]), 68);
    assert_eq!(sized("kMany ? kN : 2u", &[]), 16);
    assert_eq!(sized("kMany ? kN : 2u", &[(2, 0)]), 8);
    assert_eq!(sized("kM < 0 ? 7 : kM", &[]), 28);
    assert_eq!(sized("kM < 0 ? 7 : kM", &[(3, 5)]), 20);
    assert_eq!(sized("4u * gl_WorkGroupSize.x", &[]), 128);
    let of_size =
        "layout(local_size_x_id = 5) in; shared uint v[gl_WorkGroupSize.x * 3u]; void use() { v[0] = 1u; }";
    assert_eq!(bytes(of_size, &[(5, 16)]), 192);
    assert_eq!(sized("kN", &[(1, u32::MAX)]), 4 * u64::from(u32::MAX));
}

#[test]
fn lengths_that_cannot_be_known_count_nothing() {
    let globals = "shared uint v[8u / (kN - 4u)]; shared uint w;\nvoid use() { v[0] = 1u; w = 2u; }";
    assert_eq!(bytes(globals, &[]), 4);
    assert_eq!(bytes(globals, &[(1, 6)]), 20);
}

#[test]
fn payloads_count_on_both_sides() {
    let payload = "struct P { vec3 a; uint b[7]; }; taskPayloadSharedEXT P payload;";
    let task = format!(
        "layout(local_size_x = 1) in;\n{payload}\nshared vec4 own[4];\n\
         void main() {{ own[0] = vec4(1); payload.b[0] = uint(own[0].x); EmitMeshTasksEXT(1, 1, 1); }}"
    );
    let mesh = format!(
        "layout(local_size_x = 1) in; layout(points, max_vertices = 1, max_primitives = 1) out;\n{payload}\n\
         void main() {{ SetMeshOutputsEXT(payload.b[0], 0u); }}"
    );
    let of = |stage, text: &str| facts(stage, text).shared_memory.bytes(&Default::default());
    assert_eq!(of(ShaderStage::Task, &task), SharedBytes { shared: 64, payload: 48 });
    assert_eq!(of(ShaderStage::Mesh, &mesh), SharedBytes { shared: 0, payload: 48 });
    assert_eq!(of(ShaderStage::Fragment, "void main() {}"), SharedBytes::default());
}

/// Blocks share memory only with an extension that the caller enables.
#[test]
fn blocks_lie_in_one_another() {
    let words = words(
        ShaderStage::Compute,
        "#extension GL_EXT_shared_memory_block : require\nlayout(local_size_x = 8) in;\n\
         layout(std430) shared A { float a[4]; } a; layout(std430) shared B { layout(offset = 64) vec3 b; } b;\n\
         void main() { a.a[0] = 1; b.b = vec3(a.a[1]); }",
    );
    let found =
        reflect("test", ShaderStage::Compute, &words).unwrap().shared_memory.bytes(&Default::default());
    assert_eq!(found, SharedBytes { shared: 80, payload: 0 });
}
