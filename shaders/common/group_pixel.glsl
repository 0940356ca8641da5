// Work groups of 8 x 8, and the pixel of an invocation of theirs. A CPU runs eight invocations at once: those then see a block of 4 x 2
// pixels, whose rays keep closer together than those of a row.
#ifndef COMMON_GROUP_PIXEL_GLSL
#define COMMON_GROUP_PIXEL_GLSL

layout(local_size_x = 8, local_size_y = 8) in;

uvec2 groupPixel() {
#ifdef LVK_DEVICE_IS_CPU
    uint index = gl_LocalInvocationIndex;
    uvec2 block = uvec2(index >> 3 & 1u, index >> 4);
    return gl_WorkGroupID.xy * 8u + block * uvec2(4u, 2u) + uvec2(index & 3u, index >> 2 & 1u);
#else
    return gl_GlobalInvocationID.xy;
#endif
}

#endif
