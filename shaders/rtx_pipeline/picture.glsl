// A pixel of the picture from its light.
#ifndef RTX_PIPELINE_PICTURE
#define RTX_PIPELINE_PICTURE

#include "common/tonemap.glsl"
#include "rtx_pipeline/frame.glsl"

void store(uvec2 pixel, vec3 light) {
    imageStore(kImages2D[frame.image], ivec2(pixel), vec4(encodeSrgb(expose(light)), 1.0));
}

#endif
