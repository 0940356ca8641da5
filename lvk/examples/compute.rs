//! Squares the numbers from 0 to 1023 in a compute shader and prints the sum of the squares.
use lvk::*;

const SHADER: &str = r"
    layout(local_size_x = 64) in;
    layout(buffer_reference, scalar) readonly buffer Input { uint value[]; };
    layout(buffer_reference, scalar) writeonly buffer Output { uint value[]; };
    layout(push_constant, scalar) uniform Push { Input numbers; Output squares; uint count; };
    void main() {
        uint i = gl_GlobalInvocationID.x;
        if (i < count) squares.value[i] = numbers.value[i] * numbers.value[i];
    }";

/// The shader's block of push constants: two addresses and a number. The tail makes the struct free of padding.
#[derive(Clone, Copy, bytemuck::NoUninit)]
#[repr(C)]
struct Push {
    numbers: u64,
    squares: u64,
    count: u32,
    _tail: u32,
}

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let ctx = Context::new(&ContextDesc::default())?;
    let module = ctx.create_shader_module(&ShaderModuleDesc {
        stage: ShaderStage::Compute,
        source: ShaderSource::Glsl(SHADER),
        debug_name: "square.comp",
        ..Default::default()
    })?;
    let pipeline = ctx.create_compute_pipeline(&ComputePipelineDesc {
        module: Some(*module),
        debug_name: "square",
        ..Default::default()
    })?;
    let numbers: Vec<u32> = (0..1024).collect();
    let mut squares = vec![0_u32; numbers.len()];
    let size_bytes = size_of_val(&squares[..]) as u64;
    let output =
        ctx.create_buffer(&BufferDesc { size_bytes, debug_name: "squares", ..Default::default() })?;

    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*pipeline)?;
    // The list lives until the GPU is done with the command buffer.
    let input = cmd.upload_slice(&numbers)?;
    let count = numbers.len() as u32;
    cmd.push_constants(&Push { numbers: input, squares: output.address()?, count, _tail: 0 })?;
    let writes = Dependencies { buffers: &[*output], ..Default::default() };
    cmd.dispatch([count.div_ceil(64), 1, 1], &writes)?;
    ctx.submit(cmd)?;

    // Waits for the dispatch.
    ctx.download_buffer(*output, 0, bytemuck::cast_slice_mut(&mut squares))?;
    println!("{}", squares.iter().sum::<u32>());
    Ok(())
}
