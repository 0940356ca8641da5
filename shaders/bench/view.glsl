// The inputs of every stage of the benchmarks' tracer: the target of results, and the camera.
#ifndef BENCH_VIEW_GLSL
#define BENCH_VIEW_GLSL

struct Hit {
    float t; // kNoHit where the ray left the scene
    uint primitive;
};

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Hits { Hit at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Lit { uint at[]; };

struct BounceRay {
    vec3 origin;
    vec3 direction; // 0 where the primary ray left the scene
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BounceRays { BounceRay at[]; };

layout(push_constant, scalar) uniform Push {
    Hits hits;
    Lit lit;
    BounceRays bounceRays;
    Hits bounceHits;
    uint tlas;
    uint width;
    uint height;
    vec3 eye;
    vec3 right;
    vec3 down;
    vec3 forward;
    vec3 light;
};

const float kNoHit = -1.0;
const float kFar = 1e30;

vec3 pixelDirection(uvec2 pixel) {
    vec2 place = (vec2(pixel) + 0.5) / vec2(width, height) * 2.0 - 1.0;
    return normalize(forward + place.x * right + place.y * down);
}

// Hit position of a pixel's ray, a little towards the eye.
vec3 pixelPoint(uvec2 pixel, float t) { return eye + pixelDirection(pixel) * (t * 0.9995); }

#endif
