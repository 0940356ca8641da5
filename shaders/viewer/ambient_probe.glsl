// A probe of the surfaces around the eye, for the ambient term: rays in all directions find surfaces, and from each a ray in a direction
// that a matte surface prefers looks for the sky. The including file provides traceWithin() and transmittanceTo().
#ifndef VIEWER_AMBIENT_PROBE
#define VIEWER_AMBIENT_PROBE

#include "viewer/ambient_term.glsl"
#include "viewer/path.glsl"

// Rays from the eye: kProbeSide * kProbeSide invocations with kProbeRays each.
const uint kProbeSide = 64u;
const uint kProbeRays = 4u;
// Width of the cone of a ray over its length: textures are read as broad as their part of all directions.
const float kProbeSpread = 0.03;

vec3 sphereDirection(vec2 u) {
    float height = 1.0 - 2.0 * u.x;
    float angle = 2.0 * kPi * u.y;
    return vec3(sqrt(max(1.0 - height * height, 0.0)) * vec2(cos(angle), sin(angle)), height);
}

vec3 matteDirection(vec3 normal, vec2 u) {
    float angle = 2.0 * kPi * u.y;
    return basisOf(normal) * vec3(sqrt(u.x) * vec2(cos(angle), sin(angle)), sqrt(1.0 - u.x));
}

void probe(uvec2 place) {
    uint count = 0u;
    float openness = 0.0;
    vec3 reflectance = vec3(0.0);
    [[dont_unroll]] for (uint ray = 0u; ray < kProbeRays; ++ray) {
        // All rays are samples of one pixel, so that they are spread evenly.
        Random random = Random(0u, (place.y * kProbeSide + place.x) * kProbeRays + ray, 0u);
        Path path = cameraPath(sphereDirection(nextPair(random)));
        path.spread = kProbeSpread;
        Hit hit = nextHit(path, kFar, random);
        if (hit.instance == kNothing) {
            continue;
        }
        Surface surface = reach(path, hit);
        if ((surface.flags & kUnlit) != 0u) {
            continue;
        }
        count += 1u;
        reflectance += min(reflectanceOf(bsdfOf(surface, -path.direction)), vec3(1.0));
        vec3 direction = matteDirection(surface.geometricNormal, nextPair(random));
        vec3 through = transmittanceTo(leaveTo(surface, direction), direction, kFar);
        openness += (through.r + through.g + through.b) / 3.0;
    }
    NumberArray sums = frame.ambientSums;
    atomicAdd(sums.at[kAmbientCount], count);
    atomicAdd(sums.at[kAmbientOpenness], uint(openness * kAmbientOne + 0.5));
    for (uint channel = 0u; channel < 3u; ++channel) {
        atomicAdd(sums.at[kAmbientReflectance + channel], uint(reflectance[channel] * kAmbientOne + 0.5));
    }
}

#endif
