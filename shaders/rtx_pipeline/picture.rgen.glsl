// A pixel by the ray tracing pipeline: one ray, and whatever it meets does the rest.
#include "rtx_pipeline/picture.glsl"
#include "rtx_pipeline/radiance.glsl"

layout(location = 0) rayPayloadEXT Radiance payload;

void main() {
    uvec2 pixel = gl_LaunchIDEXT.xy;
    vec3 direction = cameraDirection(frame.camera, pixel);
    payload = Radiance(vec3(0.0), 0.0, 0u);
    traceRayEXT(kTLAS[frame.tlas], LVK_RAY_FLAG_OPAQUE, kMaskAll, 0, 0, kSky, frame.camera.eye, 0.0, direction, 1e30, 0);
    store(pixel, payload.light);
}
