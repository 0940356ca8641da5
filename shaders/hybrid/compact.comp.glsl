// Writes the vertices and numbers of the surviving triangles without gaps and in their order, so that the picture
// does not depend on which workgroup comes first; the last workgroup writes how many to draw.
#include "hybrid/unculled_triangles.glsl"

layout(local_size_x = 256) in;

shared uint before;

// Survivors in the groups before this one; every group adds up all counts itself, in place of another pass.
uint countBefore(uint group) {
    uint sum = 0u;
    for (uint i = gl_LocalInvocationIndex; i < group; i += kTrianglesPerGroup) {
        sum += frame.visibility.survivorCounts.at[i];
    }
    if (gl_LocalInvocationIndex == 0u) {
        before = 0u;
    }
    barrier();
    atomicAdd(before, sum);
    barrier();
    return before;
}

void main() {
    uint group = groupNumber();
    uint lane = gl_LocalInvocationIndex;
    uint place = countBefore(min(group, groupCount()));
    if (group >= groupCount()) {
        return;
    }
    uint word = 0u;
    for (uint i = 0u; i <= lane / 32u; ++i) {
        word = frame.visibility.survivorBits.at[group * kWordsPerGroup + i];
        place += uint(bitCount(i < lane / 32u ? word : word & ((1u << lane % 32u) - 1u)));
    }
    if ((word & 1u << lane % 32u) != 0u) {
        uint triangle = group * kTrianglesPerGroup + lane;
        uvec3 corner = frame.scene.triangles.at[triangle];
        frame.visibility.survivorIndices.at[3u * place] = corner.x;
        frame.visibility.survivorIndices.at[3u * place + 1u] = corner.y;
        frame.visibility.survivorIndices.at[3u * place + 2u] = corner.z;
        frame.visibility.survivors.at[place] = triangle;
    }
    if (group + 1u == groupCount() && lane == 0u) {
        frame.visibility.draw.at[0] = 3u * (before + frame.visibility.survivorCounts.at[group]);
    }
}
