// Counts the triangles that culling leaves.
#ifndef HYBRID_SURVIVORS
#define HYBRID_SURVIVORS

#include "hybrid/footprint.glsl"

const uint kTrianglesPerGroup = 256u;
const uint kWordsPerGroup = kTrianglesPerGroup / 32u;

// A rasteriser snaps corners to a grid of at least 16 places a pixel.
const float kSnapMargin = 0.125;

uint groupNumber() {
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

uint groupCount() {
    return (frame.visibility.triangleCount + kTrianglesPerGroup - 1u) / kTrianglesPerGroup;
}

#endif
