//! A pipeline that is created anew when the file of its shader changes.

use std::fs;
use std::path::Path;
use std::time::Duration;

use lvk::{
    BufferDesc, ComputePipelineDesc, ComputePipelineHandle, Context, ContextDesc, Dependencies, Holder,
    Reloadable, ShaderFiles, ShaderModuleDesc, ShaderStage,
};

use crate::{Failure, context_without_caches};

const TEXT: &str = "
    #include \"value.glsl\"
    layout(local_size_x = 1) in;
    layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words words; };
    void main() { words.at[0] = VALUE; }";

/// Runs a shader before and after a change of its include. Returns both words.
pub(crate) fn reload() -> Result<Vec<u8>, Failure> {
    let folder = tempfile::tempdir()?;
    let (path, value) = (folder.path().join("write.comp.glsl"), folder.path().join("value.glsl"));
    fs::write(&path, TEXT)?;
    fs::write(&value, "#define VALUE 7")?;
    // The texts lie in another folder in each run.
    let ctx = context_without_caches(ContextDesc::default())?;
    let mut pipeline =
        Reloadable::new(&ctx, move |ctx, files| create(ctx, files, &path))?.with_period(Duration::ZERO);
    let mut words = written(&ctx, **pipeline)?;
    fs::write(&value, "#define VALUE 700")?;
    if !pipeline.poll()? {
        return Err("the change is not noticed".into());
    }
    words.extend(written(&ctx, **pipeline)?);
    ctx.wait_idle()?;
    Ok(words)
}

fn create(ctx: &Context, files: &ShaderFiles, path: &Path) -> lvk::Result<Holder<ComputePipelineHandle>> {
    let desc = ShaderModuleDesc { stage: ShaderStage::Compute, debug_name: "write", ..Default::default() };
    let module = files.create_module(ctx, path, &desc)?;
    let module = Some(*module);
    ctx.create_compute_pipeline(&ComputePipelineDesc { module, debug_name: "write", ..Default::default() })
}

fn written(ctx: &Context, pipeline: ComputePipelineHandle) -> lvk::Result<Vec<u8>> {
    let buffer =
        ctx.create_buffer(&BufferDesc { size_bytes: 4, debug_name: "word", ..Default::default() })?;
    let mut cmd = ctx.acquire_command_buffer()?;
    cmd.bind_compute_pipeline(pipeline)?;
    cmd.push_constants(&buffer.address()?)?;
    cmd.dispatch([1, 1, 1], &Dependencies { buffers: &[*buffer], ..Default::default() })?;
    ctx.submit(cmd)?;
    let mut word = vec![0; 4];
    ctx.download_buffer(*buffer, 0, &mut word)?;
    Ok(word)
}
