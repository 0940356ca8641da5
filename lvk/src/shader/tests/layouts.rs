//! Tests of Rust structs against the blocks of compiled shaders.
#![allow(dead_code, reason = "the structs are only compared")]

use crate::shader::layout_comparison::compare_layout;
use crate::shader::shader_layout::ShaderLayout;
use crate::shader::spirv::blocks::{BlockKind, Blocks};

use super::*;

crate::shader_struct! {
    /// A struct inside of another.
    #[repr(C)]
    struct Camera {
        eye: [f32; 3],
        near_plane: f32,
    }

    #[repr(C)]
    struct Push {
        camera: Camera,
        frame: u64,
        lights: [Light; 2],
        sampler as smp: u32,
        image: u32,
    }

    #[repr(C)]
    struct Light {
        color: [f32; 3],
        reach: f32,
    }
}

/// The block that `Push` fits, with other members in place of some.
fn push_block(edits: &[(&str, &str)]) -> String {
    let mut text = "struct Camera { vec3 eye; float nearPlane; };
        struct Light { vec3 color; float reach; };
        layout(buffer_reference, scalar) buffer Frame { uint at[]; };
        layout(push_constant, scalar) uniform Push {
            Camera camera; Frame frame; Light lights[2]; uint smp; uint image; };"
        .to_owned();
    for (from, to) in edits {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

fn blocks(globals: &str) -> Blocks {
    facts(ShaderStage::Compute, &shader(ShaderStage::Compute, globals, "")).blocks
}

/// Returns all differences of `T` and a block, as text.
fn differences<T: ShaderLayout>(globals: &str, kind: BlockKind, name: &str) -> Vec<String> {
    let blocks = blocks(globals);
    let block = blocks.list.iter().find(|block| block.kind == kind && block.name == name);
    let block = block.unwrap_or_else(|| panic!("no block {name}: {blocks:?}"));
    let compared = compare_layout(&T::LAYOUT, &blocks, block.ty).unwrap();
    compared.differences.iter().chain(&compared.missing).map(ToString::to_string).collect()
}

fn push_differences(edits: &[(&str, &str)]) -> Vec<String> {
    differences::<Push>(&push_block(edits), BlockKind::PushConstants, "Push")
}

#[test]
fn equal_members_have_no_differences() {
    assert_eq!(push_differences(&[]), [""; 0]);
    // Addresses as numbers, and a vector of integers of the same size.
    assert_eq!(push_differences(&[("Frame frame;", "uvec2 frame;")]), [""; 0]);
}

#[test]
fn each_kind_of_difference_has_its_text() {
    let expect =
        |edits: &[(&str, &str)], texts: &[&str]| assert_eq!(push_differences(edits), texts, "{edits:?}");
    expect(
        &[("uint smp; uint image;", "uint image; uint smp;")],
        &["'sampler' and 'image' are swapped: in the block, 'image' comes before 'smp'"],
    );
    expect(
        &[("vec3 eye; float nearPlane;", "float nearPlane; vec3 eye;")],
        &[
            "'camera.eye' and 'camera.near_plane' are swapped: in the block, 'camera.nearPlane' comes before 'camera.eye'",
        ],
    );
    expect(
        &[("uint smp; uint image;", "layout(offset = 64) uint smp; uint image;")],
        &[
            "'sampler' is at byte 56 of the struct, but 'smp' at byte 64 of the block",
            "'image' is at byte 60 of the struct, but 'image' at byte 68 of the block",
        ],
    );
    expect(
        &[("uint smp; uint image;", "uint smp; uvec2 image;")],
        &["'image' has 4 bytes in the struct, but 'image' has 8 in the block"],
    );
    expect(
        &[("uint smp; uint image;", "uint smp; uint image; uint depth;")],
        &["the struct lacks 'depth' (4 bytes at byte 64 of the block)"],
    );
    expect(
        &[("uint smp; uint image;", "uint smp;")],
        &["the block lacks 'image' (4 bytes at byte 60 of the struct)"],
    );
    expect(
        &[(
            "Light lights[2]; uint smp; uint image;",
            "Light lights[1]; layout(offset = 56) uint smp; uint image;",
        )],
        &["'lights' has 2 elements in the struct, but 'lights' has 1 in the block"],
    );
    expect(
        &[("float reach; };", "float reach; float more; };")],
        &[
            "'sampler' is at byte 56 of the struct, but 'smp' at byte 64 of the block",
            "'image' is at byte 60 of the struct, but 'image' at byte 68 of the block",
            "the elements of 'lights' are 16 bytes apart in the struct, but those of 'lights' 20 bytes in the block",
            "the struct lacks 'lights.more' (4 bytes at byte 16 of the block)",
        ],
    );
}

crate::shader_struct! {
    #[repr(C)]
    struct Shapes {
        rows: [[f32; 4]; 3],
        points: [[f32; 3]; 3],
        normal: [f32; 3],
        _padding: f32,
        matrix: [[f32; 4]; 3],
        count: u32,
    }
}

/// In `std430`, a vector of three floats takes the room of four in arrays and matrices.
#[test]
fn strides_of_arrays_and_matrices_count() {
    let block = |qualifier: &str, members: &str| {
        let text = format!(
            "layout(buffer_reference, {qualifier}) buffer Shapes {{ {members} }};
             layout(push_constant) uniform Push {{ Shapes shapes; }};"
        );
        differences::<Shapes>(&text, BlockKind::BufferReference, "Shapes")
    };
    let scalar =
        block("scalar", "vec4 rows[3]; vec3 points[3]; vec3 normal; float pad; mat3x4 matrix; uint count;");
    assert_eq!(scalar, ["the struct lacks 'pad' (4 bytes at byte 96 of the block)"]);
    let named =
        block("scalar", "vec4 rows[3]; vec3 points[3]; vec3 normal; float _pad; mat3x4 matrix; uint count;");
    assert_eq!(named, [""; 0]);
    let rows = block(
        "scalar",
        "vec4 rows[3]; vec3 points[3]; vec3 normal; float padding; layout(row_major) mat4x3 matrix; uint count;",
    );
    assert_eq!(rows, [""; 0], "three rows of four are the bytes of three columns of four");
    let size = |texts: Vec<String>, member: &str| {
        texts.into_iter().find(|text| text.starts_with(&format!("'{member}' has")))
    };
    assert_eq!(
        size(block("std430", "vec4 rows[3]; vec3 points[3];"), "points").unwrap(),
        "'points' has 36 bytes in the struct, but 'points' has 48 in the block, as its elements are 16 bytes apart"
    );
    assert_eq!(size(block("std430", "mat3 matrix;"), "matrix"), None);
    assert_eq!(
        size(block("scalar", "mat3 matrix;"), "matrix").unwrap(),
        "'matrix' has 48 bytes in the struct, but 'matrix' has 36 in the block, as its elements are 12 bytes apart"
    );
}

crate::shader_struct! {
    #[repr(C)]
    struct Flattened {
        part as camera_and_more: Camera,
        tail: u32,
    }

    #[repr(C)]
    struct Element {
        place: [f32; 2],
        kind: u32,
    }
}

#[test]
fn nested_structs_may_be_flattened_in_the_block() {
    let text = "layout(push_constant, scalar) uniform P { vec3 eye; float nearPlane; uint tail; };";
    assert_eq!(differences::<Flattened>(text, BlockKind::PushConstants, "P"), [""; 0]);
    let text = "layout(push_constant, scalar) uniform P { float nearPlane; vec3 eye; uint tail; };";
    assert_eq!(
        differences::<Flattened>(text, BlockKind::PushConstants, "P"),
        ["'part.eye' and 'part.near_plane' are swapped: in the block, 'nearPlane' comes before 'eye'"]
    );
}

#[test]
fn a_list_without_a_length_is_compared_by_its_elements() {
    let block = |element: &str| {
        let text = format!(
            "struct Element {{ {element} }};
             layout(buffer_reference, scalar) buffer List {{ Element at[]; }};
             layout(push_constant) uniform Push {{ List list; }};"
        );
        differences::<Element>(&text, BlockKind::BufferReference, "List")
    };
    assert_eq!(block("vec2 place; uint kind;"), [""; 0]);
    assert_eq!(
        block("uint kind; vec2 place;"),
        ["'place' and 'kind' are swapped: in the block, 'kind' comes before 'place'"]
    );
    assert_eq!(
        block("vec2 place; uint kind; uint more;"),
        [
            "the elements of 'Element' are 12 bytes apart in the struct, but those of 'at' 16 bytes in the block",
            "the struct lacks 'more' (4 bytes at byte 12 of the block)"
        ]
    );
}

#[test]
fn blocks_of_all_kinds_are_listed_and_records_measured() {
    let text = shader(
        ShaderStage::Miss,
        "layout(buffer_reference, scalar) buffer Items { vec3 at[]; };
         layout(shaderRecordEXT, scalar) buffer Record { Items items; vec3 color; };
         layout(location = 0) rayPayloadInEXT vec3 answer;",
        "answer = color + items.at[0];",
    );
    let blocks = facts(ShaderStage::Miss, &text).blocks;
    let mut kinds: Vec<_> = blocks.list.iter().map(|block| (block.name.as_str(), block.kind)).collect();
    kinds.sort_unstable_by_key(|(name, _)| *name);
    assert_eq!(kinds, [("Items", BlockKind::BufferReference), ("Record", BlockKind::ShaderRecord)]);
    assert_eq!(blocks.record_bytes(), Some(20));
}
