// Work groups of 8 x 8, and the pixel of an invocation of theirs.
#ifndef COMMON_GROUP_PIXEL_GLSL
#define COMMON_GROUP_PIXEL_GLSL

layout(local_size_x = 8, local_size_y = 8) in;

#ifdef LVK_DEVICE_IS_CPU

// The row of the picture's work groups that one of the launch takes. lavapipe hands each thread a run of work groups, all as long,
// and waits for the last: so each run has rows from all over the picture, and none the costly half. First come rows whose numbers
// are multiples of 4, then those 2 beyond, 1 beyond and 3.
uint groupRow() {
    const uint kBeyond[4] = uint[](0u, 2u, 1u, 3u);
    uint row = 0u, begin = 0u;
    [[unroll]] for (uint i = 0u; i < 4u; ++i) {
        row = gl_WorkGroupID.y >= begin ? (gl_WorkGroupID.y - begin) * 4u + kBeyond[i] : row;
        begin += (gl_NumWorkGroups.y + 3u - kBeyond[i]) / 4u;
    }
    return row;
}

// A CPU runs eight invocations at once: they see a block of 4 x 2 pixels, whose rays keep closer together than those of a row.
// Numbered by their subgroups, as lavapipe divides for each one to find its place in the work group otherwise.
uvec2 groupPixel() {
    uint index = gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
    uvec2 block = uvec2(index >> 3 & 1u, index >> 4);
    uvec2 group = uvec2(gl_WorkGroupID.x, groupRow());
    return group * 8u + block * uvec2(4u, 2u) + uvec2(index & 3u, index >> 2 & 1u);
}

#else

uvec2 groupPixel() {
    return gl_GlobalInvocationID.xy;
}

#endif

#endif
