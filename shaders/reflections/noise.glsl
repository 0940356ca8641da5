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

// Place of a pixel on Hilbert's curve through tiles of 64 x 64 pixels: neighbours on it are neighbours in the picture.
uint curvePlace(uvec2 pixel) {
    uvec2 at = pixel & 63u;
    uint place = 0u;
    for (uint side = 32u; side > 0u; side >>= 1u) {
        uvec2 upper = uvec2(notEqual(at & side, uvec2(0u)));
        place += side * side * ((3u * upper.x) ^ upper.y);
        if (upper.y == 0u) {
            at = upper.x == 1u ? 63u - at : at;
            at = at.yx;
        }
    }
    return place;
}

// As pixelNoise(), but neighbouring pixels and the samples of each take evenly spread numbers (the R2 sequence along
// the curve), so that a filter over few of them sees all of the range. For one purpose only in a ray: those of several
// depend on each other.
vec2 spreadNoise(uvec2 pixel, uint purpose) {
    // Steps along the sequence from sample to sample that spread as well as those from pixel to pixel, and lead far away.
    const uint kSampleStride = 834u;
    uint place = curvePlace(pixel) + kSampleStride * frame.sampleNumber;
    uvec2 start = scramble(uvec3(frame.frameNumber, purpose, 5u)).xy;
    return vec2((start + place * uvec2(3242174889u, 2447445413u)) >> 8u) / 16777216.0;
}

mat3 basisAround(vec3 n) {
    float s = n.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + n.z);
    float b = n.x * n.y * a;
    return mat3(vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3(b, s + n.y * n.y * a, -n.y), n);
}

#endif
