//! A batch of BLASes: split, compacted, serialised and loaded, then traced.

use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, BuildFlags,
    ComputePipelineDesc, Context, ContextDesc, Dependencies, DeviceProfile, Holder, RayQueryRequest,
    RayTracingPipelineRequest, ShaderModuleDesc, ShaderSource, ShaderStage, TextureDesc, TextureRegion,
    TextureUsage, TlasDesc, TlasInstance, Triangles,
};

use crate::{Failure, context};

/// Triangles of a mesh: they do not fit one structure of the profile.
const TRIANGLES: u32 = 200;

const TRACE: &str = r"
    #include <lvk/ray_query.glsl>
    layout(local_size_x = 8, local_size_y = 8) in;
    layout(push_constant) uniform Push { uint tlas, image; };
    void main() {
        vec2 point = (gl_GlobalInvocationID.xy + 0.5) / 16.0 - 1.0;
        LvkRayQuery rq;
        lvkRayQueryInitialize(rq, tlas, LVK_RAY_FLAG_OPAQUE, 0xFF, vec3(point, -1), 0.0, vec3(0, 0, 1), 2.0);
        while (lvkRayQueryProceed(rq)) {}
        bool hit = lvkRayQueryType(rq, LVK_COMMITTED) == LVK_COMMITTED_TRIANGLE;
        imageStore(kImages2D[image], ivec2(gl_GlobalInvocationID.xy), hit ? vec4(1, 0.5, 0, 1) : vec4(0.1));
    }";

/// The batch as structures of the device.
pub(crate) fn on_device() -> Result<Vec<u8>, Failure> {
    let profile = DeviceProfile {
        name: "small structures".into(),
        max_blas_primitives: 60,
        max_accel_structure_bytes: 16 << 10,
        ..DeviceProfile::default()
    };
    let ray_query = RayQueryRequest::HardwareIfPresent;
    let ray_tracing_pipeline = RayTracingPipelineRequest::HardwareIfPresent;
    let profile = Some(&profile);
    batch(&context(ContextDesc { profile, ray_query, ray_tracing_pipeline, ..Default::default() })?)
}

/// The batch as BVHs that software traverses.
pub(crate) fn in_software() -> Result<Vec<u8>, Failure> {
    batch(&context(ContextDesc { ray_query: RayQueryRequest::Software, ..Default::default() })?)
}

/// A BLAS that is serialised while its compaction is under way: its size is known, and the copy comes with the next submission. Returns
/// the number of bytes.
pub(crate) fn serialized_in_compaction() -> Result<Vec<u8>, Failure> {
    let (ray_query, ray_tracing_pipeline) = (RayQueryRequest::Hardware, RayTracingPipelineRequest::Off);
    let ctx = context(ContextDesc { ray_query, ray_tracing_pipeline, ..Default::default() })?;
    let positions = positions(&ctx, 0.0)?;
    let blas = ctx.create_blas(&BlasDesc {
        geometries: &[BlasGeometry::Triangles(Triangles::packed(*positions, 3 * TRIANGLES))],
        flags: BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION,
        debug_name: "stripes",
        ..Default::default()
    })?;
    ctx.compact(&[*blas])?;
    ctx.wait_idle()?;
    let bytes = ctx.serialize_blas(*blas)?;
    ctx.wait_idle()?;
    Ok(bytes.len().to_le_bytes().to_vec())
}

/// Creates the positions of narrow triangles side by side, in a half of the picture.
fn positions(ctx: &Context, half: f32) -> lvk::Result<Holder<BufferHandle>> {
    let corners = |index: u32| {
        let x = -1.0 + 2.0 * index as f32 / TRIANGLES as f32;
        [[x, half - 0.8, 0.0], [x + 0.006, half - 0.8, 0.0], [x, half - 0.2, 0.0_f32]]
    };
    let corners: Vec<_> = (0..TRIANGLES).flat_map(corners).collect();
    let (usage, data) = (BufferUsage::ACCEL_INPUT, Some(bytemuck::cast_slice(&corners)));
    ctx.create_buffer(&BufferDesc { usage, data, debug_name: "positions", ..Default::default() })
}

fn batch(ctx: &Context) -> Result<Vec<u8>, Failure> {
    let buffers = [positions(ctx, 0.0)?, positions(ctx, 1.0)?];
    let geometries = buffers
        .each_ref()
        .map(|buffer| [BlasGeometry::Triangles(Triangles::packed(**buffer, 3 * TRIANGLES))]);
    let flags = BuildFlags::FAST_TRACE | BuildFlags::ALLOW_COMPACTION;
    let descs = geometries.each_ref().map(|geometries| BlasDesc {
        geometries,
        flags,
        debug_name: "stripes",
        ..Default::default()
    });
    let built = ctx.create_blas_batch(&descs)?;
    let handles: Vec<_> = built.iter().map(|blas| **blas).collect();
    ctx.compact(&handles)?;
    // The sizes come first, then the copies.
    (0..3).try_for_each(|_| ctx.wait_idle())?;
    let files = handles.iter().map(|blas| ctx.serialize_blas(*blas)).collect::<lvk::Result<Vec<_>>>()?;
    drop(built);
    let mut loaded = Vec::new();
    for (desc, bytes) in descs.iter().zip(&files) {
        // SAFETY: the bytes are those that the library has just written.
        loaded.push(unsafe { ctx.load_blas(desc, bytes)? });
    }
    let pixels = trace(ctx, &loaded)?;
    ctx.wait_idle()?;
    Ok(pixels)
}

/// Returns the pixels of a picture of the structures.
fn trace(ctx: &Context, blases: &[Holder<AccelStructHandle>]) -> lvk::Result<Vec<u8>> {
    let instances: Vec<_> = blases.iter().map(|blas| TlasInstance::new(**blas)).collect();
    let tlas =
        ctx.create_tlas(&TlasDesc { instances: &instances, debug_name: "scene", ..Default::default() })?;
    let (extent, usage) = ([32, 32], TextureUsage::STORAGE);
    let image =
        ctx.create_texture(&TextureDesc { extent, usage, debug_name: "picture", ..Default::default() })?;
    let (stage, source) = (ShaderStage::Compute, ShaderSource::Glsl(TRACE));
    let module = ctx.create_shader_module(&ShaderModuleDesc {
        stage,
        source,
        debug_name: "trace.comp",
        ..Default::default()
    })?;
    let module = Some(*module);
    let pipeline = ctx.create_compute_pipeline(&ComputePipelineDesc {
        module,
        debug_name: "trace",
        ..Default::default()
    })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(*pipeline)?;
    cmd.push_constants(&[tlas.index(), image.index()])?;
    cmd.dispatch([4, 4, 1], &Dependencies { storage_images: &[*image], ..Default::default() })?;
    ctx.submit(cmd)?;
    ctx.download_texture(*image, &TextureRegion::default())
}
