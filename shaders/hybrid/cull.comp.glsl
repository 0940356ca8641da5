// Culling for the hardware rasteriser: a bit for each triangle that may cover the centre of a pixel.
#include "hybrid/unculled_triangles.glsl"

layout(local_size_x = 256) in;

shared uint bits[kWordsPerGroup];

void main() {
    uint group = groupNumber();
    uint lane = gl_LocalInvocationIndex;
    uint triangle = group * kTrianglesPerGroup + lane;
    if (lane < kWordsPerGroup) {
        bits[lane] = 0u;
    }
    barrier();
    bool isInside = triangle < frame.visibility.triangleCount;
    if (isInside && !isEmpty(footprintOf(cornersFromEye(triangle), kSnapMargin))) {
        atomicOr(bits[lane / 32u], 1u << lane % 32u);
    }
    barrier();
    if (group >= groupCount()) {
        return;
    }
    if (lane < kWordsPerGroup) {
        frame.visibility.survivorBits.at[group * kWordsPerGroup + lane] = bits[lane];
    }
    if (lane == 0u) {
        uint count = 0u;
        for (uint i = 0u; i < kWordsPerGroup; ++i) {
            count += uint(bitCount(bits[i]));
        }
        frame.visibility.survivorCounts.at[group] = count;
    }
}
