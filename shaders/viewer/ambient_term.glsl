// The ambient term: the radiance that surfaces around the eye return, in the mean. What they are like is found by the rays of
// ambient_probe.glsl.
#ifndef VIEWER_AMBIENT_TERM
#define VIEWER_AMBIENT_TERM

#include "viewer/frame.glsl"

// Sums over the surfaces that the probe has found: places in frame.ambientSums. All but the count are in units of 1 / kAmbientOne.
const uint kAmbientCount = 0u;
const uint kAmbientOpenness = 1u; // the share of what lies around a surface that is sky
const uint kAmbientReflectance = 2u; // three channels
const float kAmbientOne = 4096.0;
// Share of the light of surfaces that comes back to them, at most.
const float kMostInterreflected = 0.95;

// Light of lamps and of the sky comes to surfaces, and goes from one to the next until the sky or they have taken it (the ambient term of
// Cohen et al., "A Progressive Refinement Approach to Fast Radiosity Image Generation", 1988, with an open side).
vec3 ambientRadiance() {
    NumberArray sums = frame.ambientSums;
    float share = 1.0 / (kAmbientOne * max(float(sums.at[kAmbientCount]), 1.0));
    float openness = share * float(sums.at[kAmbientOpenness]);
    vec3 reflectance = share * vec3(sums.at[kAmbientReflectance], sums.at[kAmbientReflectance + 1u], sums.at[kAmbientReflectance + 2u]);
    vec3 irradiance = frame.lampIrradiance + openness * frame.openIrradiance;
    return reflectance * irradiance / (kPi * (1.0 - min(reflectance * (1.0 - openness), kMostInterreflected)));
}

#endif
