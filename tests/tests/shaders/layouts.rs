//! Layouts of Rust structs against the blocks of shaders, when a pipeline is created.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]
#![allow(dead_code, reason = "most structs are only compared")]

use bytemuck::NoUninit;
use lvk::{
    BlockLayout, ComputePipelineDesc, Context, Dependencies, Error, Format, HitGroup, LayoutDifference,
    RayTracingLibraryDesc, RayTracingPipelineDesc, RenderPipelineDesc, ShaderModuleDesc, ShaderModuleHandle,
    ShaderRecord, ShaderSource, ShaderStage, record_bytes,
};
use lvk_tests::compute::{read_words, words_buffer};
use lvk_tests::device;

lvk::shader_struct! {
    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct Push {
        words: u64,
        first: u32,
        second: u32,
    }

    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct Swapped {
        words: u64,
        second: u32,
        first: u32,
    }

    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct Values {
        low: u32,
        high: u32,
    }
}

const SHADER: &str = "
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) buffer Words { uint low; uint high; };
    layout(push_constant, scalar) uniform Push { Words words; uint first; uint second; };
    void main() { words.low = first; words.high = second; }";

fn module(ctx: &Context, stage: ShaderStage, text: &str) -> lvk::Holder<ShaderModuleHandle> {
    let source = ShaderSource::Glsl(text);
    ctx.create_shader_module(&ShaderModuleDesc { stage, source, debug_name: "shader", ..Default::default() })
        .unwrap()
}

#[test]
fn equal_layouts_make_a_pipeline_that_reads_them() {
    let Some(ctx) = device() else { return };
    let module = module(&ctx, ShaderStage::Compute, SHADER);
    let layouts = &[BlockLayout::push_constants::<Push>(), BlockLayout::buffer_reference::<Values>("Words")];
    let desc = ComputePipelineDesc { module: Some(*module), layouts, ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc).unwrap();
    let words = words_buffer(&ctx, &[0; 2]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&Push { words: words.address().unwrap(), first: 5, second: 7 }).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*words], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *words, 2), [5, 7]);
}

#[test]
fn differences_of_a_compute_pipeline_name_everything() {
    let Some(ctx) = device() else { return };
    let module = module(&ctx, ShaderStage::Compute, SHADER);
    let create = |layouts: &[BlockLayout]| {
        let desc =
            ComputePipelineDesc { module: Some(*module), layouts, debug_name: "fill", ..Default::default() };
        ctx.create_compute_pipeline(&desc).unwrap_err()
    };
    let swapped = create(&[BlockLayout::push_constants::<Swapped>()]);
    assert_eq!(
        swapped.to_string(),
        "pipeline 'fill': the struct Swapped differs from the push constants 'Push' of shader 'shader': 'second' and \
         'first' are swapped: in the block, 'first' comes before 'second'"
    );
    let Error::LayoutMismatch { struct_name: "Swapped", differences, .. } = &swapped else {
        unreachable!("{swapped}")
    };
    assert!(matches!(&differences[..], [LayoutDifference::Swapped { .. }]));
    assert_eq!(
        create(&[BlockLayout::buffer_reference::<Push>("Words")]).to_string(),
        "pipeline 'fill': the struct Push differs from the buffer reference 'Words' of shader 'shader': the struct lacks \
         'low' (4 bytes at byte 0 of the block); the struct lacks 'high' (4 bytes at byte 4 of the block); the block lacks \
         'words' (8 bytes at byte 0 of the struct); the block lacks 'first' (4 bytes at byte 8 of the struct); the block \
         lacks 'second' (4 bytes at byte 12 of the struct)"
    );
    assert_eq!(
        create(&[BlockLayout::buffer_reference::<Values>("Numbers")]).to_string(),
        "fill: none of its shaders has a buffer_reference block 'Numbers', for which the layout of Values was given; the \
         blocks are 'Words'"
    );
}

lvk::shader_struct! {
    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct Draw {
        offset: [f32; 2],
        shade: f32,
    }
}

/// The stages of a graphics pipeline may read different members of the same push constants.
#[test]
fn stages_share_the_members_of_one_struct() {
    let Some(ctx) = device() else { return };
    let vertex = |members: &str| {
        let text = format!(
            "layout(push_constant, scalar) uniform Draw {{ {members} }};
             void main() {{ gl_Position = vec4(offset, 0, 1); }}"
        );
        module(&ctx, ShaderStage::Vertex, &text)
    };
    let fragment = |members: &str| {
        let text = format!(
            "layout(push_constant, scalar) uniform Draw {{ {members} }};
             layout(location = 0) out vec4 color;
             void main() {{ color = vec4(shade); }}"
        );
        module(&ctx, ShaderStage::Fragment, &text)
    };
    let create = |vertex: ShaderModuleHandle, fragment: Option<ShaderModuleHandle>| {
        let desc = RenderPipelineDesc {
            vertex: Some(vertex),
            fragment,
            color: &[Format::Rgba8Unorm.into()],
            layouts: &[BlockLayout::push_constants::<Draw>()],
            debug_name: "draws",
            ..Default::default()
        };
        ctx.create_render_pipeline(&desc).map(drop)
    };
    let (first, whole) = (vertex("vec2 offset;"), fragment("vec2 offset; float shade;"));
    create(*first, Some(*whole)).unwrap();
    let shade = fragment("layout(offset = 8) float shade;");
    create(*first, Some(*shade)).unwrap();
    let lacking = create(*first, None).unwrap_err();
    assert!(matches!(lacking, Error::LayoutMismatch { .. }), "{lacking:?}");
    assert!(
        lacking.to_string().ends_with("the block lacks 'shade' (4 bytes at byte 8 of the struct)"),
        "{lacking}"
    );
    let wrong = fragment("float shade; vec2 offset;");
    let error = create(*first, Some(*wrong)).unwrap_err();
    assert!(matches!(error, Error::LayoutMismatch { .. }), "{error:?}");
    assert!(error.to_string().contains("'offset' and 'shade' are swapped"), "{error}");
    let none = module(&ctx, ShaderStage::Vertex, "void main() { gl_Position = vec4(1); }");
    let error = create(*none, None).unwrap_err();
    assert_eq!(
        error.to_string(),
        "draws: none of its shaders has push constants, for which the layout of Draw was given"
    );
}

lvk::shader_struct! {
    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct Paint {
        color: [f32; 3],
        gloss: f32,
    }

    #[derive(Clone, Copy, NoUninit)]
    #[repr(C)]
    struct WrongPaint {
        gloss: f32,
        color: [f32; 3],
    }
}

const RECORD: &str = "
    layout(shaderRecordEXT, scalar) buffer Record { vec3 color; float gloss; };
    layout(location = 0) rayPayloadInEXT vec4 answer;
    void main() { answer = vec4(color, gloss); }";

#[test]
fn records_are_compared_with_the_blocks_of_their_shaders() {
    let Some(ctx) = device() else { return };
    if !ctx.capabilities().ray_tracing_pipeline {
        eprintln!("NOT TESTED, {} has no ray tracing pipelines", ctx.capabilities().device_name);
        return;
    }
    let ray_gen = module(&ctx, ShaderStage::RayGen, "void main() {}");
    let (hit, miss) =
        (module(&ctx, ShaderStage::ClosestHit, RECORD), module(&ctx, ShaderStage::Miss, RECORD));
    let (good, wrong) = (Paint { color: [1.0; 3], gloss: 0.5 }, WrongPaint { gloss: 0.5, color: [1.0; 3] });
    let create = |hit_record: ShaderRecord<'_>, miss_record: ShaderRecord<'_>| {
        let hit_group = HitGroup { closest_hit: Some(*hit), record: hit_record, ..Default::default() };
        let desc = RayTracingPipelineDesc {
            ray_gen: &[*ray_gen],
            miss: &[*miss],
            hit_groups: &[hit_group],
            miss_records: &[miss_record],
            debug_name: "paints",
            ..Default::default()
        };
        ctx.create_ray_tracing_pipeline(&desc).map(drop)
    };
    let typed = ShaderRecord::new(&good);
    create(typed, typed).unwrap();
    create(record_bytes(&good), ShaderRecord::from_bytes(&[0; 20])).unwrap();
    assert_eq!(
        create(ShaderRecord::new(&wrong), typed).unwrap_err().to_string(),
        "pipeline 'paints': the struct WrongPaint differs from the shader record 'Record' of shader 'shader': 'gloss' and \
         'color' are swapped: in the block, 'color' comes before 'gloss'"
    );
    let error = create(typed, ShaderRecord::new(&wrong)).unwrap_err();
    assert!(matches!(error, Error::LayoutMismatch { .. }), "{error}");
    assert_eq!(
        create(record_bytes(&[0_u32; 2]), typed).unwrap_err().to_string(),
        "pipeline 'paints': the record of hit group 0 has 8 bytes, but shader 'shader' reads 16 bytes; make the Rust \
         struct match the shader's block"
    );
    let error = create(typed, ShaderRecord::default()).unwrap_err();
    let Error::ShaderRecord { group, expected: 16, size: 0, .. } = &error else { unreachable!("{error}") };
    assert_eq!(group, "miss shader 0");
    if ctx.capabilities().pipeline_libraries {
        let library = RayTracingLibraryDesc { miss: &[*miss], ..Default::default() };
        let error = ctx.create_ray_tracing_library(&library).unwrap_err();
        assert!(matches!(error, Error::ShaderRecord { .. }), "{error}");
        let miss_records = &[typed];
        drop(ctx.create_ray_tracing_library(&RayTracingLibraryDesc { miss_records, ..library }).unwrap());
    }
}
