// A probe of the surfaces around the eye, for the ambient term: rays towards places all over the box of the scene find surfaces, and from
// each a ray in a direction that a matte surface prefers looks for the sky. `argument` is the number of invocations along each side of the
// launch. The including file provides traceWithin() and transmittanceTo().
#ifndef VIEWER_AMBIENT_PROBE
#define VIEWER_AMBIENT_PROBE

#include "viewer/ambient_term.glsl"
#include "viewer/path.glsl"

// Rays of an invocation.
const uint kProbeRays = 4u;
// Width of the cone of a ray over its length: textures are read about as broad as the share of a ray.
const float kProbeSpread = 0.03;

// A surface that reflects: what it shows of other places, through it, is not its own.
bool isReflector(Surface surface, vec3 reflectance) {
    bool isNumber = !any(isnan(reflectance)) && !any(isinf(reflectance));
    return isNumber && (surface.flags & kUnlit) == 0u && surface.transmission <= 0.0;
}

void probe(uvec2 place) {
    uint count = 0u;
    float visibility = 0.0;
    vec3 reflectance = vec3(0.0);
    [[dont_unroll]] for (uint ray = 0u; ray < kProbeRays; ++ray) {
        // All rays are samples of one pixel, so that they are spread evenly.
        Random random = Random(0u, (place.y * argument + place.x) * kProbeRays + ray, 0u);
        vec2 aside = nextPair(random);
        vec3 aim = mix(frame.boxMin, frame.boxMax, vec3(aside, nextPair(random).x));
        vec3 way = aim - frame.camera.eye;
        Path path = cameraPath(way / max(length(way), 1e-30));
        path.spread = kProbeSpread;
        Hit hit = nextHit(path, kFar, random);
        if (hit.instance == kNothing) {
            continue;
        }
        Surface surface = reach(path, hit);
        vec3 own = reflectanceOf(bsdfOf(surface, -path.direction));
        if (!isReflector(surface, own)) {
            continue;
        }
        count += 1u;
        reflectance += clamp(own, 0.0, 1.0);
        vec3 direction = basisOf(surface.geometricNormal) * cosineDirection(nextPair(random));
        vec3 through = transmittanceTo(leaveTo(surface, direction), direction, kFar);
        visibility += clamp((through.r + through.g + through.b) / 3.0, 0.0, 1.0);
    }
    NumberArray sums = frame.ambientSums;
    atomicAdd(sums.at[kAmbientCount], count);
    atomicAdd(sums.at[kAmbientVisibility], uint(visibility * kAmbientScale + 0.5));
    for (uint channel = 0u; channel < 3u; ++channel) {
        atomicAdd(sums.at[kAmbientReflectance + channel], uint(reflectance[channel] * kAmbientScale + 0.5));
    }
}

#endif
