// Light from all around: a hazy sky above a pale ground.
#ifndef HYBRID_OIT_SKY
#define HYBRID_OIT_SKY

#include "hybrid_oit/frame.glsl"

const vec3 kHorizon = vec3(0.66, 0.68, 0.73);
const vec3 kZenith = vec3(0.13, 0.24, 0.46);
const vec3 kGround = vec3(0.30, 0.28, 0.27);

// Radiance along a direction of unit length, the sun's disc left out.
vec3 skyAlong(vec3 direction) {
    float up = direction.y;
    vec3 above = mix(kHorizon, kZenith, 1.0 - exp(-3.2 * max(up, 0.0)));
    float glow = pow(max(dot(direction, frame.sunDirection), 0.0), 12.0);
    above += 0.25 * glow * frame.sunColor;
    return mix(kGround, above, smoothstep(-0.3, -0.02, up));
}

// Mean radiance over the half space around a normal, weighted by the cosine; fitted by eye to the above.
vec3 skyAround(vec3 normal) {
    const vec3 fromAbove = vec3(0.30, 0.37, 0.50);
    const vec3 fromBelow = vec3(0.26, 0.23, 0.21);
    return mix(fromBelow, fromAbove, 0.5 + 0.5 * normal.y);
}

#endif
