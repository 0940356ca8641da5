// Rays of a pixel, by the ray tracing pipeline.
#include "rtx_textures/surface.glsl"

layout(location = 0) rayPayloadEXT Found payload;

// Hit shaders find how far the ray has come in the distance, and leave there how far away they are.
Found traceNearest(vec3 origin, vec3 direction, float travelled) {
    payload.distance = travelled;
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_OPAQUE, 0xffu, 0, 0, 0, origin, 0.0, direction, 1e4, 0);
    return payload;
}

bool reachesSky(vec3 origin, vec3 direction) {
    payload.distance = 0.0;
    const uint flags =
        LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT | LVK_RAY_FLAG_SKIP_CLOSEST_HIT_SHADER;
    traceRayEXT(kTLAS[frame.tlas], flags, 0xffu, 0, 0, 0, origin, 0.0, direction, 1e4, 0);
    return payload.distance < 0.0;
}

#include "rtx_textures/shade.glsl"

void main() {
    renderPixel(gl_LaunchIDEXT.xy);
}
