// A plane as grey.
#include "common/tonemap.glsl"
#include "yuv/push.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) flat in uint which;
layout(location = 0) out vec4 color;

void main() {
    vec4 texel = textureBindless2DLod(planes[which], smp, place, 0.0);
    color = vec4(decodeSrgb(vec3(texel[channels[which]])), 1.0);
}
