// The sky where nothing hides it.
#include "common/tonemap.glsl"
#include "sponza/frame.glsl"

layout(location = 0) in vec2 inPlace;
layout(location = 0) out vec4 outColor;

void main() {
    vec3 direction = frame.camera.forward + inPlace.x * frame.camera.right + inPlace.y * frame.camera.down;
    outColor = vec4(expose(textureBindlessCubeLod(frame.sky, frame.skySampler, direction, 0.0).rgb), 1.0);
}
