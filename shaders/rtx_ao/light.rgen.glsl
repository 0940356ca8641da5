// The light of the surface of a pixel, by the ray tracing pipeline.
#include "rtx_ao/frame.glsl"

layout(location = 0) rayPayloadEXT uint blocked;

bool isBlocked(vec3 origin, vec3 direction, float range) {
    blocked = 1u;
    const uint flags =
        LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, 0xffu, 0, 0, 0, origin, 0.0, direction, range, 0);
    return blocked != 0u;
}

#include "rtx_ao/light.glsl"

void main() {
    ivec2 pixel = ivec2(gl_LaunchIDEXT.xy);
    vec4 position = textureBindlessFetch2D(frame.position, pixel, 0);
    vec4 light = vec4(0.0);
    if (position.w > 0.0) {
        vec3 normal = textureBindlessFetch2D(frame.normal, pixel, 0).xyz;
        vec3 geometric = textureBindlessFetch2D(frame.geometric, pixel, 0).xyz;
        light = lightAt(position.xyz, normal, geometric, uvec2(pixel));
    }
    imageStore(kImages2D[frame.light], pixel, light);
}
