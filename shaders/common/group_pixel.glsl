// Work groups for 8 x 8 pixels, and the pixels of an invocation of theirs: kGroupPixels, of which groupPixel() is the first and
// groupStep() leads from there to each.
#ifndef COMMON_GROUP_PIXEL_GLSL
#define COMMON_GROUP_PIXEL_GLSL

#ifdef LVK_DEVICE_IS_CPU

// A CPU runs eight invocations at once. A work group is no more than that and goes through its pixels in blocks of 4 x 2, whose rays
// keep closer together than those of a row: so what starting it costs, lavapipe clearing the stack of queries above all, is paid once.
layout(local_size_x = 8) in;
const uint kGroupPixels = 8u;

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

uvec2 groupPixel() {
    uint index = gl_LocalInvocationID.x;
    return uvec2(gl_WorkGroupID.x, groupRow()) * 8u + uvec2(index & 3u, index >> 2);
}

uvec2 groupStep(uint place) {
    return uvec2(place & 1u, place >> 1) * uvec2(4u, 2u);
}

#else

layout(local_size_x = 8, local_size_y = 8) in;
const uint kGroupPixels = 1u;

uvec2 groupPixel() {
    return gl_GlobalInvocationID.xy;
}

uvec2 groupStep(uint place) {
    return uvec2(0u);
}

#endif

#endif
