// Depth as grey: bright is close to the lamp.
#include "omni_shadows/frame.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) flat in uint side;
layout(location = 0) out vec4 color;

void main() {
    // The view shows depth in all channels.
    vec3 depth = textureBindless2DLod(frame.faces[side], frame.reading, place, 0.0).rgb;
    color = vec4(exp(-0.45 * frame.lampNear / max(depth, 1e-6)), 1.0);
}
