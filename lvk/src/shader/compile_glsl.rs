//! Compiles GLSL to SPIR-V without a context.

use super::ShaderModuleDesc;
use super::compile::compile;
use super::options::{CompileFiles, CompileOptions};
use super::spirv::reflect::reflect;
use crate::error::Result;
use crate::gpu::caps::capabilities::Capabilities;

/// Compiles `desc` to the SPIR-V that a context on a device with `capabilities` produces, without opening a device.
///
/// Caches and tools use it to compile ahead of time. [`ShaderSource::Spirv`](super::ShaderSource::Spirv) accepts the
/// result.
///
/// The preamble depends on the device. The words are valid on every device that has at least
/// [`Capabilities::formatless_storage_read`] and [`Capabilities::position_fetch`] as given here.
/// `Capabilities::default()` has neither, so its words need nothing of the device that the text itself does not need.
///
/// # Errors
/// [`Error::Shader`](crate::Error::Shader) with the compiler's text, or if the module declares resources outside the
/// bindless set.
pub fn compile_glsl(desc: &ShaderModuleDesc<'_>, capabilities: &Capabilities) -> Result<Vec<u32>> {
    let words = compile(desc, &CompileOptions::from_capabilities(capabilities), CompileFiles::default())?;
    reflect(desc.debug_name, desc.stage, &words)?;
    Ok(words)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test")]
    use super::*;
    use crate::shader::{ShaderSource, ShaderStage};

    fn compiled(text: &str, capabilities: &Capabilities) -> Result<Vec<u32>> {
        let source = ShaderSource::Glsl(text);
        let desc = ShaderModuleDesc {
            stage: ShaderStage::Compute,
            source,
            debug_name: "ahead of time",
            ..ShaderModuleDesc::default()
        };
        compile_glsl(&desc, capabilities)
    }

    #[test]
    fn capabilities_of_the_device_decide_the_extensions_of_the_text() {
        let text = "layout(local_size_x = 1) in; layout(push_constant) uniform Push { uint image; };
            void main() { imageStore(kImages2D[image], ivec2(0), imageLoad(kImages2D[image], ivec2(1))); }";
        let capable = Capabilities { formatless_storage_read: true, ..Capabilities::default() };
        assert_eq!(compiled(text, &capable).unwrap()[0], 0x0723_0203);
        assert!(compiled(text, &Capabilities::default()).is_err());
    }

    #[test]
    fn errors_name_the_module_and_the_callers_line() {
        let message =
            compiled("\nvoid main() { nothing(); }", &Capabilities::default()).unwrap_err().to_string();
        assert!(message.contains("'ahead of time'") && message.contains("nothing"), "{message}");
        let foreign =
            "layout(local_size_x = 1) in; layout(set = 3, binding = 0) buffer Other { uint value; } other;
            void main() { other.value = 1; }";
        assert!(compiled(foreign, &Capabilities::default()).is_err());
    }
}
