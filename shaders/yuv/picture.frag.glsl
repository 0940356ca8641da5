// The moving picture in colours, which the sampler of its texture makes.
#include "common/tonemap.glsl"

LVK_YUV_TEXTURES(kYuv);

layout(constant_id = 0) const uint picture = 0;
layout(location = 0) in vec2 place;
layout(location = 0) out vec4 color;

void main() {
    color = vec4(decodeSrgb(clamp(textureBindlessYUV(kYuv, picture, place).rgb, 0.0, 1.0)), 1.0);
}
