// The inputs of a fragment in the passes over opaque and transparent surfaces.
#ifndef REFLECTIONS_FRAGMENT
#define REFLECTIONS_FRAGMENT

#include "reflections/gbuffer.glsl"
#include "reflections/waves.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inTexcoord;
layout(location = 3) flat in uint inQuad;

vec3 facing(vec3 normal, vec3 direction) {
    return dot(normal, direction) > 0.0 ? -normal : normal;
}

// Transparent surfaces are mirrors from both sides, those of water with ripples.
vec3 transparentNormal(Material material, vec3 direction) {
    vec3 n = material.density > 0.0 ? waterNormal(inPosition.xz, frame.phase) : normalize(inNormal);
    return facing(n, direction);
}

// The depth test against the opaque surfaces, which are sampled beside.
bool isHidden() {
    return gl_FragCoord.z < textureBindlessFetch2D(frame.opaqueDepth, ivec2(gl_FragCoord.xy), 0).r;
}

#endif
