//! Push constants and specialization constants: shaders read the given values, and mismatches return errors.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use lvk::{
    ComputePipelineDesc, ComputePipelineHandle, Context, Dependencies, Error, Holder, ShaderModuleDesc,
    ShaderSource, ShaderStage, SpecializationConstant, SpecializationValue,
};
use lvk_tests::compute::{compute_pipeline, module, read_words, words_buffer};
use lvk_tests::device;

/// A block of `words` words, the first two an address; copies the others to the address.
fn echo(ctx: &Context, words: usize) -> Holder<ComputePipelineHandle> {
    let text = format!(
        "layout(local_size_x = 1) in;
         layout(buffer_reference, scalar) writeonly buffer Result {{ uint at[]; }};
         layout(push_constant, scalar) uniform Push {{ Result result; uint words[{0}]; }};
         void main() {{ for (uint i = 0; i < {0}; ++i) result.at[i] = words[i]; }}",
        words - 2
    );
    compute_pipeline(ctx, &text)
}

fn block(ctx: &Context, result: lvk::BufferHandle, rest: &[u32]) -> Vec<u8> {
    let mut bytes = ctx.buffer_address(result).unwrap().to_le_bytes().to_vec();
    bytes.extend_from_slice(bytemuck::cast_slice(rest));
    bytes
}

#[test]
fn the_whole_block_arrives_up_to_the_largest() {
    let Some(ctx) = device() else { return };
    let largest = ctx.capabilities().limits.max_push_constant_bytes.min(256) as usize / 4;
    for words in [3, 10, largest] {
        let pipeline = echo(&ctx, words);
        let values: Vec<u32> = (0..words as u32 - 2).map(|i| 1000 + i * i).collect();
        let result = words_buffer(&ctx, &vec![0; words]);
        let mut cmd = ctx.acquire_command_buffer().unwrap();
        cmd.bind_compute_pipeline(*pipeline).unwrap();
        cmd.push_constant_bytes(0, &block(&ctx, *result, &values)).unwrap();
        let writes = Dependencies { buffers: &[*result], ..Default::default() };
        cmd.dispatch([1, 1, 1], &writes).unwrap();
        ctx.submit(cmd).unwrap();
        assert_eq!(read_words(&ctx, *result, words - 2), values);
    }
}

#[test]
fn a_part_can_be_replaced_and_outlives_the_pipeline() {
    let Some(ctx) = device() else { return };
    let (long, short) = (echo(&ctx, 6), echo(&ctx, 4));
    let [first, second] = [0, 0].map(|word| words_buffer(&ctx, &[word; 4]));
    let writes = [*first, *second];
    let writes = Dependencies { buffers: &writes, ..Default::default() };
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*long).unwrap();
    cmd.push_constant_bytes(0, &block(&ctx, *first, &[1, 2, 3, 4])).unwrap();
    cmd.push_constant_bytes(12, &20_u32.to_le_bytes()).unwrap();
    cmd.dispatch([1, 1, 1], &writes).unwrap();
    cmd.push_constant_bytes(0, &block(&ctx, *second, &[5, 6, 7, 8])).unwrap();
    cmd.bind_compute_pipeline(*short).unwrap();
    cmd.dispatch([1, 1, 1], &writes).unwrap();
    ctx.submit(cmd).unwrap();
    assert_eq!(read_words(&ctx, *first, 4), [1, 20, 3, 4]);
    assert_eq!(read_words(&ctx, *second, 4), [5, 6, 0, 0]);
}

#[test]
fn pushes_that_do_not_fit_the_block_are_errors() {
    let Some(ctx) = device() else { return };
    let pipeline = echo(&ctx, 5);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    let error = cmd.push_constants(&[0_u32; 5]).unwrap_err();
    assert!(
        matches!(&error, Error::InvalidUsage { .. }) && error.to_string().contains("bind a pipeline"),
        "{error}"
    );
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    for (offset, size) in [(0, 36), (0, 400), (0, 18), (2, 4), (18, 4), (32, 4), (u32::MAX - 3, 4), (0, 0)] {
        match cmd.push_constant_bytes(offset, &vec![0; size]) {
            Err(Error::PushConstants { pipeline, expected, offset: found, size: bytes }) => {
                assert_eq!((expected, found, bytes as usize), (20, offset, size));
                assert_eq!(pipeline, "compute pipeline");
            }
            other => unreachable!("{size} bytes at {offset}: {other:?}"),
        }
    }
    assert!(matches!(cmd.push_constants(&[0_u32; 4]), Err(Error::PushConstants { expected: 20, .. })));
    let error = cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap_err();
    assert!(error.to_string().contains("20 bytes of push constants, but 0"), "{error}");
    cmd.push_constant_bytes(0, &[0; 16]).unwrap();
    let error = cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap_err();
    assert!(error.to_string().contains("20 bytes of push constants, but 16"), "{error}");
    let without = compute_pipeline(&ctx, "layout(local_size_x = 1) in; void main() {}");
    cmd.bind_compute_pipeline(*without).unwrap();
    assert!(matches!(cmd.push_constants(&1_u32), Err(Error::PushConstants { expected: 0, .. })));
    cmd.dispatch([1, 1, 1], &Dependencies::default()).unwrap();
    ctx.submit(cmd).unwrap();
}

#[test]
fn constants_never_pushed_are_missed_wherever_they_lie() {
    let Some(ctx) = device() else { return };
    let pipeline = echo(&ctx, 5);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constant_bytes(16, &[0; 4]).unwrap();
    let result = cmd.dispatch([1, 1, 1], &Dependencies::default());
    assert!(
        matches!(&result, Err(Error::InvalidUsage { .. })),
        "16 bytes at the start were never pushed: {result:?}"
    );
}

#[test]
fn blocks_over_the_limit_are_refused() {
    let Some(ctx) = device() else { return };
    let text = "
        layout(local_size_x = 1) in;
        layout(push_constant, scalar) uniform Push { uint words[2000]; };
        shared uint sum;
        void main() { sum = words[1999]; }";
    let desc = ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(text),
        debug_name: "wide",
        ..Default::default()
    };
    match ctx.create_shader_module(&desc) {
        Err(Error::LimitExceeded { object, requested, .. }) => {
            assert_eq!((object.as_str(), requested), ("wide", 8000))
        }
        other => unreachable!("{other:?}"),
    }
}

const CONSTANTS: &str = "
    layout(local_size_x_id = 7, local_size_y = 1, local_size_z = 1) in;
    layout(constant_id = 0) const uint unsigned_ = 1;
    layout(constant_id = 1) const int signed_ = 2;
    layout(constant_id = 2) const float real_ = 3.0;
    layout(constant_id = 3) const bool truth_ = false;
    layout(buffer_reference, scalar) writeonly buffer Result { uint at[]; };
    layout(push_constant, scalar) uniform Push { Result result; };
    void main() {
        uint values[4] = uint[](unsigned_, uint(signed_), floatBitsToUint(real_), truth_ ? 1 : 0);
        result.at[gl_LocalInvocationIndex] = values[gl_LocalInvocationIndex];
    }";

/// Runs one workgroup of a specialized shader, and returns the words that it writes to the address in its push constants.
fn specialized_result(
    ctx: &Context,
    text: &str,
    specialization: &[SpecializationConstant],
    count: usize,
) -> Vec<u32> {
    let module = module(ctx, ShaderStage::Compute, text);
    let desc = ComputePipelineDesc { module: Some(*module), specialization, ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc).unwrap();
    let result = words_buffer(ctx, &vec![99; count]);
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    cmd.push_constants(&ctx.buffer_address(*result).unwrap()).unwrap();
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*result], ..Default::default() }).unwrap();
    ctx.submit(cmd).unwrap();
    read_words(ctx, *result, count)
}

fn constants(ctx: &Context, specialization: &[SpecializationConstant]) -> Vec<u32> {
    specialized_result(ctx, CONSTANTS, specialization, 4)
}

fn constant(id: u32, value: SpecializationValue) -> SpecializationConstant {
    SpecializationConstant { id, value }
}

#[test]
fn specialization_constants_take_their_values() {
    let Some(ctx) = device() else { return };
    let size = constant(7, SpecializationValue::U32(4));
    assert_eq!(constants(&ctx, &[size]), [1, 2, 3.0_f32.to_bits(), 0]);
    let all = [
        constant(3, SpecializationValue::Bool(true)),
        constant(1, SpecializationValue::I32(-5)),
        constant(0, SpecializationValue::U32(u32::MAX)),
        constant(2, SpecializationValue::F32(0.1)),
        size,
    ];
    assert_eq!(constants(&ctx, &all), [u32::MAX, -5_i32 as u32, 0.1_f32.to_bits(), 1]);
    assert_eq!(constants(&ctx, &[constant(7, SpecializationValue::U32(2))])[2..], [99, 99]);
}

#[test]
fn unknown_and_wide_specialization_constants_are_errors() {
    let Some(ctx) = device() else { return };
    let refuse = |text: &str, id: u32, words: &str| {
        let module = module(&ctx, ShaderStage::Compute, text);
        let specialization = [constant(id, SpecializationValue::U32(1))];
        let desc = ComputePipelineDesc {
            module: Some(*module),
            specialization: &specialization,
            debug_name: "odd one",
            ..Default::default()
        };
        match ctx.create_compute_pipeline(&desc) {
            Err(Error::InvalidUsage { object, message }) => {
                assert!(object == "odd one" && message.contains(words), "{object}: {message}");
            }
            other => unreachable!("{other:?}"),
        }
    };
    refuse(CONSTANTS, 4, "no shader declares the specialization constant 4");
    if ctx.capabilities().shader_int64 {
        let wide = "
            layout(local_size_x = 1) in;
            layout(constant_id = 5) const uint64_t wide = 1;
            shared uint sum;
            void main() { sum = uint(wide); }";
        refuse(wide, 5, "has 64 bits in a shader, and 32 were given");
    }
}

const WIDE_CONSTANTS: &str = "
    layout(local_size_x = 1) in;
    layout(constant_id = 4) const double real_ = 3.0LF;
    layout(constant_id = 9) const uint narrow_ = 5;
    layout(constant_id = 0) const uint64_t unsigned_ = 1;
    layout(constant_id = 1) const int64_t signed_ = 2;
    layout(buffer_reference, scalar) writeonly buffer Result { uint64_t unsigned_; int64_t signed_; double real_; uint narrow_; };
    layout(push_constant, scalar) uniform Push { Result result; };
    void main() {
        result.unsigned_ = unsigned_;
        result.signed_ = signed_;
        result.real_ = real_;
        result.narrow_ = narrow_;
    }";

fn wide_constants(ctx: &Context, specialization: &[SpecializationConstant]) -> (u64, i64, f64, u32) {
    let words = specialized_result(ctx, WIDE_CONSTANTS, specialization, 7);
    let wide = |at: usize| u64::from(words[at]) | u64::from(words[at + 1]) << 32;
    (wide(0), wide(2).cast_signed(), f64::from_bits(wide(4)), words[6])
}

#[test]
fn specialization_constants_of_64_bits_take_their_values() {
    let Some(ctx) = device() else { return };
    let wide = ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(WIDE_CONSTANTS),
        ..Default::default()
    };
    if matches!(ctx.create_shader_module(&wide), Err(Error::Unsupported { .. })) {
        eprintln!("NOT TESTED, the device has no numbers of 64 bits");
        return;
    }
    assert_eq!(wide_constants(&ctx, &[]), (1, 2, 3.0, 5));
    let all = [
        constant(9, SpecializationValue::U32(77)),
        constant(1, SpecializationValue::I64(i64::MIN + 3)),
        constant(4, SpecializationValue::F64(0.1)),
        constant(0, SpecializationValue::U64(u64::MAX - 1)),
    ];
    assert_eq!(wide_constants(&ctx, &all), (u64::MAX - 1, i64::MIN + 3, 0.1, 77));
    assert_eq!(wide_constants(&ctx, &all[2..3]), (1, 2, 0.1, 5));
    let module = module(&ctx, ShaderStage::Compute, CONSTANTS);
    let specialization = [constant(0, SpecializationValue::U64(1))];
    let desc =
        ComputePipelineDesc { module: Some(*module), specialization: &specialization, ..Default::default() };
    let refused = ctx.create_compute_pipeline(&desc);
    let words = "has 32 bits in a shader, and 64 were given";
    assert!(
        matches!(&refused, Err(Error::InvalidUsage { message, .. }) if message.contains(words)),
        "{refused:?}"
    );
}
