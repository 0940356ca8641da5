// The ambient term: the radiance that surfaces around the eye return, in the mean. What they are like is found by the rays of
// ambient_probe.glsl.
#ifndef VIEWER_AMBIENT_TERM
#define VIEWER_AMBIENT_TERM

#include "viewer/frame.glsl"

// Sums over the surfaces that the probe has found: places in frame.ambientSums. All but the count are in units of 1 / kAmbientScale.
const uint kAmbientCount = 0u;
const uint kAmbientVisibility = 1u; // of the sky
const uint kAmbientReflectance = 2u; // three channels
const float kAmbientScale = 4096.0;
// A surface that is there from the start, for scenes of which the probe finds nothing: it sees all of the sky.
const float kFirstReflectance = 0.5;
// Share of the light of surfaces that meets surfaces again and is returned, at most.
const float kMostReturned = 0.95;

float ambientMean(uint place, float first) {
    NumberArray sums = frame.ambientSums;
    return (first + float(sums.at[place]) / kAmbientScale) / (1.0 + float(sums.at[kAmbientCount]));
}

// The share of the directions of surfaces, weighted by the cosine, in which nothing hides the sky.
float skyVisibility() {
    return ambientMean(kAmbientVisibility, 1.0);
}

// Light of lamps and of the sky comes to surfaces, and goes from one to the next until the sky or they have taken it (the ambient term of
// Cohen et al., "A Progressive Refinement Approach to Fast Radiosity Image Generation", 1988, with an open side).
vec3 ambientRadiance() {
    float visibility = skyVisibility();
    vec3 reflectance;
    for (uint channel = 0u; channel < 3u; ++channel) {
        reflectance[channel] = ambientMean(kAmbientReflectance + channel, kFirstReflectance);
    }
    vec3 irradiance = frame.lampIrradiance + visibility * frame.unoccludedIrradiance;
    return reflectance * irradiance / (kPi * (1.0 - min(reflectance * (1.0 - visibility), kMostReturned)));
}

#endif
