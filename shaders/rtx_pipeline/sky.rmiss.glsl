// Miss shader kSky: a ray that left the scene.
#include "rtx_pipeline/frame.glsl"
#include "rtx_pipeline/radiance.glsl"

layout(location = 0) rayPayloadInEXT Radiance payload;

void main() {
    payload.light = textureBindlessCubeLod(frame.sky, frame.skySampler, gl_WorldRayDirectionEXT, 0.0).rgb;
}
