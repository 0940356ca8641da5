// Light that the air scatters towards the eye: beams through the lattice.
#ifndef OMNI_SHADOWS_HAZE
#define OMNI_SHADOWS_HAZE

#include "omni_shadows/shadow.glsl"

const uint kSteps = 32u;

// Between the eye and what it sees. Steps are of equal angle as the lamp sees them ("Importance Sampling Techniques for Path
// Tracing in Participating Media", Kulla and Fajardo): that takes the fall of the light with the square of the distance in.
vec3 hazeBefore(vec3 position) {
    vec3 eye = frame.camera.eye;
    float depth = distance(eye, position);
    vec3 direction = (position - eye) / depth;
    float nearest = dot(frame.light - eye, direction);
    float aside = max(distance(frame.light, eye + nearest * direction), 0.02);
    float first = atan(-nearest / aside);
    float last = atan((depth - nearest) / aside);
    float sum = 0.0;
    for (uint i = 0u; i < kSteps; ++i) {
        float angle = mix(first, last, (float(i) + pixelNoise()) / float(kSteps));
        vec3 way = eye + (nearest + aside * tan(angle)) * direction - frame.light;
        sum += compareAlong(frame.linearComparing, way, longest(way));
    }
    return frame.haze * frame.intensity * (last - first) / aside * sum / float(kSteps);
}

#endif
