//! GLSL of the rows for peers that take SPIR-V and have descriptor sets of their own.

use std::sync::LazyLock;

use glslang::limits::ResourceLimits;
use glslang::{Compiler, CompilerOptions, ShaderInput, ShaderMessage, SpirvVersion, Target, VulkanVersion};

use super::peer::Failure;

/// Stage of a shader.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GlslStage {
    /// Vertex shader.
    Vertex,
    /// Fragment shader.
    Fragment,
    /// Compute shader.
    Compute,
    /// Ray generation shader.
    RayGen,
    /// Miss shader.
    Miss,
    /// Closest-hit shader.
    ClosestHit,
}

/// Vertex shader of [`Row::Draws`](super::Row::Draws): all corners lie at one point.
pub const PUSH_VERTEX: &str = "#version 460
    layout(push_constant) uniform Push { uvec4 words[4]; };
    void main() { gl_Position = vec4(float(words[0].x) + 1.0); }";
/// Fragment shader of [`Row::Draws`](super::Row::Draws).
pub const PUSH_FRAGMENT: &str = "#version 460
    layout(push_constant) uniform Push { uvec4 words[4]; };
    layout(location = 0) out vec4 color;
    void main() { color = vec4(words[0]); }";
/// Compute shader of [`Row::Dispatches`](super::Row::Dispatches): adds 1 to each number.
pub const COUNT_COMPUTE: &str = "#version 460
    layout(local_size_x = 64) in;
    layout(set = 0, binding = 0) buffer Numbers { uint numbers[]; };
    void main() { numbers[gl_GlobalInvocationID.x] += 1; }";
/// Vertex shader of [`Row::TexturedFrame`](super::Row::TexturedFrame): the cell of a texture.
pub const TEXTURES_VERTEX: &str = "#version 460
    layout(push_constant) uniform Push { uint number; uint side; };
    void main() {
        uvec2 corner = uvec2(gl_VertexIndex & 1, gl_VertexIndex >> 1);
        uvec2 cell = uvec2(number % (side / 2), number / (side / 2));
        gl_Position = vec4(vec2(2 * (cell + corner)) / float(side) * 2.0 - 1.0, 0.0, 1.0);
    }";
/// Fragment shader of [`Row::TexturedFrame`](super::Row::TexturedFrame): the first texel of a texture.
pub const TEXTURES_FRAGMENT: &str = "#version 460
    #extension GL_EXT_nonuniform_qualifier : require
    #extension GL_EXT_samplerless_texture_functions : require
    layout(push_constant) uniform Push { uint number; uint side; };
    layout(set = 0, binding = 0) uniform texture2D textures[];
    layout(location = 0) out vec4 color;
    void main() { color = texelFetch(textures[number], ivec2(0), 0); }";

/// Compute shader of [`Row::RayQueryFrame`](super::Row::RayQueryFrame).
pub const RAY_QUERY: &str = "#version 460
    #extension GL_EXT_ray_query : require
    layout(local_size_x = 8, local_size_y = 8) in;
    layout(push_constant) uniform View { vec4 eye, right, down, forward; };
    struct Hit { float t; uint primitive; };
    layout(set = 0, binding = 0) uniform accelerationStructureEXT tlas;
    layout(set = 0, binding = 1) writeonly buffer Hits { Hit hits[]; };
    void main() {
        uvec2 pixel = gl_GlobalInvocationID.xy, size = uvec2(eye.w, right.w);
        if (pixel.x >= size.x || pixel.y >= size.y) return;
        vec2 place = (vec2(pixel) + 0.5) / vec2(size) * 2.0 - 1.0;
        vec3 direction = normalize(forward.xyz + place.x * right.xyz + place.y * down.xyz);
        rayQueryEXT rq;
        rayQueryInitializeEXT(rq, tlas, gl_RayFlagsOpaqueEXT, 0xff, eye.xyz, 0.0, direction, 1e30);
        while (rayQueryProceedEXT(rq)) {}
        Hit hit = Hit(-1.0, 0u);
        if (rayQueryGetIntersectionTypeEXT(rq, true) == gl_RayQueryCommittedIntersectionTriangleEXT) {
            hit.t = rayQueryGetIntersectionTEXT(rq, true);
            hit.primitive = uint(rayQueryGetIntersectionPrimitiveIndexEXT(rq, true));
        }
        hits[pixel.y * size.x + pixel.x] = hit;
    }";

/// Ray generation shader of [`Row::RayPipelineFrame`](super::Row::RayPipelineFrame).
pub const RAY_GENERATION: &str = "#version 460
    #extension GL_EXT_ray_tracing : require
    layout(push_constant) uniform View { vec4 eye, right, down, forward; };
    struct Hit { float t; uint primitive; };
    layout(set = 0, binding = 0) uniform accelerationStructureEXT tlas;
    layout(set = 0, binding = 1) writeonly buffer Hits { Hit hits[]; };
    layout(location = 0) rayPayloadEXT Hit hit;
    void main() {
        uvec2 pixel = gl_LaunchIDEXT.xy, size = gl_LaunchSizeEXT.xy;
        vec2 place = (vec2(pixel) + 0.5) / vec2(size) * 2.0 - 1.0;
        vec3 direction = normalize(forward.xyz + place.x * right.xyz + place.y * down.xyz);
        hit = Hit(-1.0, 0u);
        traceRayEXT(tlas, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, eye.xyz, 0.0, direction, 1e30, 0);
        hits[pixel.y * size.x + pixel.x] = hit;
    }";
/// Miss shader of [`Row::RayPipelineFrame`](super::Row::RayPipelineFrame).
pub const RAY_MISS: &str = "#version 460
    #extension GL_EXT_ray_tracing : require
    struct Hit { float t; uint primitive; };
    layout(location = 0) rayPayloadInEXT Hit hit;
    void main() { hit.t = -1.0; }";
/// Closest-hit shader of [`Row::RayPipelineFrame`](super::Row::RayPipelineFrame).
pub const RAY_CLOSEST_HIT: &str = "#version 460
    #extension GL_EXT_ray_tracing : require
    struct Hit { float t; uint primitive; };
    layout(location = 0) rayPayloadInEXT Hit hit;
    void main() { hit = Hit(gl_HitTEXT, uint(gl_PrimitiveID)); }";

static LIMITS: LazyLock<ResourceLimits> = LazyLock::new(ResourceLimits::default);

/// Compiles GLSL to SPIR-V.
///
/// # Errors
/// The compiler's text.
pub fn compile(stage: GlslStage, text: &str) -> Result<Vec<u32>, Failure> {
    let compiler = Compiler::acquire().ok_or("glslang cannot start")?;
    let source = glslang::ShaderSource::from(text);
    let options = CompilerOptions {
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_3, spirv_version: SpirvVersion::SPIRV1_4 },
        messages: ShaderMessage::VULKAN_RULES | ShaderMessage::SPV_RULES,
        ..CompilerOptions::default()
    };
    let stage = match stage {
        GlslStage::Vertex => glslang::ShaderStage::Vertex,
        GlslStage::Fragment => glslang::ShaderStage::Fragment,
        GlslStage::Compute => glslang::ShaderStage::Compute,
        GlslStage::RayGen => glslang::ShaderStage::RayGeneration,
        GlslStage::Miss => glslang::ShaderStage::Miss,
        GlslStage::ClosestHit => glslang::ShaderStage::ClosestHit,
    };
    let defines: Option<&[(&str, Option<&str>)]> = None;
    let input = ShaderInput::new_with_limits(&source, &LIMITS, stage, &options, defines, None)?;
    Ok(compiler.create_shader(input)?.compile()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shader_compiles() {
        let shaders = [
            (GlslStage::Vertex, PUSH_VERTEX),
            (GlslStage::Fragment, PUSH_FRAGMENT),
            (GlslStage::Compute, COUNT_COMPUTE),
            (GlslStage::Vertex, TEXTURES_VERTEX),
            (GlslStage::Fragment, TEXTURES_FRAGMENT),
            (GlslStage::Compute, RAY_QUERY),
            (GlslStage::RayGen, RAY_GENERATION),
            (GlslStage::Miss, RAY_MISS),
            (GlslStage::ClosestHit, RAY_CLOSEST_HIT),
        ];
        for (stage, text) in shaders {
            assert_eq!(compile(stage, text).unwrap()[0], 0x0723_0203, "{text}");
        }
        let wrong = compile(GlslStage::Vertex, "#version 460\nvoid main() { nothing(); }").unwrap_err();
        assert!(wrong.to_string().contains("nothing"), "{wrong}");
    }
}
