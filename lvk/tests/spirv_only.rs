//! Tests of the library without its feature `glsl`, which needs no C++ compiler. Shaders are SPIR-V words. With the
//! feature `software-ray-query` the library's own kernels run too. `LVK_TEST_LIBRARY` names a Vulkan loader in place
//! of the system's.
#![cfg(not(feature = "glsl"))]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on has failed")]

use lvk::{
    BufferDesc, ComputePipelineDesc, Context, ContextDesc, Dependencies, Error, RayQueryRequest,
    ShaderModuleDesc, ShaderSource, ShaderStage,
};

/// Returns a context. Without a device it prints a line and returns `None`, unless `LVK_REQUIRE_GPU` is set.
fn context() -> Option<Context> {
    let library = std::env::var_os("LVK_TEST_LIBRARY").map(std::path::PathBuf::from);
    let made = Context::new(&ContextDesc {
        vulkan_library: library.as_deref(),
        ray_query: match cfg!(feature = "software-ray-query") {
            true => RayQueryRequest::Software,
            false => RayQueryRequest::Auto,
        },
        ..Default::default()
    });
    match made {
        Err(error) if std::env::var_os("LVK_REQUIRE_GPU").is_none() => {
            eprintln!("NOT TESTED, there is no device: {error}");
            None
        }
        made => Some(made.unwrap()),
    }
}

fn words() -> Vec<u32> {
    let bytes = include_bytes!("spirv_only.comp.spv");
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

#[test]
fn words_run_and_texts_are_refused() {
    const COUNT: u32 = 1000;
    let Some(ctx) = context() else { return };
    let text = ShaderModuleDesc { source: ShaderSource::Glsl("void main() {}"), ..Default::default() };
    let refused = ctx.create_shader_module(&text).unwrap_err();
    assert!(matches!(&refused, Error::Unsupported { why, .. } if why.contains("`glsl`")), "{refused}");

    let words = words();
    let (source, stage) = (ShaderSource::Spirv(&words), ShaderStage::Compute);
    let module = ctx.create_shader_module(&ShaderModuleDesc { source, stage, ..Default::default() }).unwrap();
    let desc = ComputePipelineDesc { module: Some(*module), ..Default::default() };
    let pipeline = ctx.create_compute_pipeline(&desc).unwrap();
    let size_bytes = u64::from(COUNT) * 4;
    let target = ctx.create_buffer(&BufferDesc { size_bytes, ..Default::default() }).unwrap();
    let mut cmd = ctx.acquire_command_buffer().unwrap();
    cmd.bind_compute_pipeline(*pipeline).unwrap();
    let address = ctx.buffer_address(*target).unwrap();
    let (low, high) = (address as u32, (address >> 32) as u32);
    cmd.push_constants(&[low, high, COUNT]).unwrap();
    let dependencies = Dependencies { buffers: &[*target], ..Default::default() };
    cmd.dispatch([COUNT.div_ceil(64), 1, 1], &dependencies).unwrap();
    ctx.submit(cmd).unwrap();
    let mut bytes = vec![0; COUNT as usize * 4];
    ctx.download_buffer(*target, 0, &mut bytes).unwrap();
    for (i, found) in (0..).zip(bytes.chunks_exact(4)) {
        assert_eq!(found, u32::to_le_bytes(i * i + 7), "{i}");
    }
}

/// Builds acceleration structures with kernels that are compiled to SPIR-V words.
#[cfg(feature = "software-ray-query")]
#[test]
fn accel_structs_are_built_by_kernels() {
    use lvk::{
        BlasDesc, BlasGeometry, BufferUsage, BuildFlags, MemoryKind, TlasDesc, TlasInstance, Triangles,
    };

    let Some(ctx) = context() else { return };
    let corners: Vec<f32> = (0..900).map(|number| (number * number % 89) as f32).collect();
    let desc = BufferDesc {
        data: Some(bytemuck::cast_slice(&corners)),
        usage: BufferUsage::ACCEL_INPUT | BufferUsage::STORAGE,
        memory: MemoryKind::Device,
        ..Default::default()
    };
    let vertices = ctx.create_buffer(&desc).unwrap();
    let geometries = [BlasGeometry::Triangles(Triangles::packed(*vertices, 300))];
    let flags = BuildFlags::FAST_BUILD | BuildFlags::ALLOW_UPDATE;
    let mesh = ctx.create_blas(&BlasDesc { geometries: &geometries, flags, ..Default::default() }).unwrap();
    let instances = [TlasInstance::new(*mesh)];
    let tlas = ctx.create_tlas(&TlasDesc { instances: &instances, ..Default::default() }).unwrap();
    ctx.wait_idle().unwrap();
    assert!(ctx.blas_sizes(&BlasDesc { geometries: &geometries, flags, ..Default::default() }).is_ok());
    drop((tlas, mesh));
}

#[cfg(not(feature = "software-ray-query"))]
#[test]
fn software_queries_are_refused() {
    let desc = ContextDesc { ray_query: RayQueryRequest::Software, ..Default::default() };
    match Context::new(&desc) {
        Err(Error::Unsupported { why, .. }) => assert!(why.contains("`software-ray-query`"), "{why}"),
        other => panic!("{:?}", other.err()),
    }
}
