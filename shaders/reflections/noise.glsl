// Repeatable noise: the same for a frame however it is reached.
#ifndef REFLECTIONS_NOISE
#define REFLECTIONS_NOISE

#include "reflections/frame.glsl"

// Jarzynski and Olano, "Hash Functions for GPU Rendering": pcg3d.
uvec3 scramble(uvec3 v) {
    v = v * 1664525u + 1013904223u;
    v += v.yzx * v.zxy;
    v ^= v >> 16u;
    return v + v.yzx * v.zxy;
}

// Two numbers from 0 to 1 for a pixel; `purpose` tells uses apart. The samples of a pixel are spread evenly.
vec2 pixelNoise(uvec2 pixel, uint purpose) {
    uvec3 hashed = scramble(uvec3(pixel, frame.frameNumber * 16u + purpose));
    vec2 start = vec2(hashed.xy >> 8u) / 16777216.0;
    return fract(start + float(frame.sampleNumber) * vec2(0.7548776662, 0.5698402910));
}

mat3 basisAround(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

#endif
