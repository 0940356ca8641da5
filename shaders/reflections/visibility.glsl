// Visibility of each light from the surface of a pixel, one ray each, and ambient visibility. Colours are
// put to it after it was smoothed (smooth.comp.glsl, composite.comp.glsl): so textures and highlights stay sharp.
// The including file provides traceOccluder() and traceOccluded().
#ifndef REFLECTIONS_VISIBILITY
#define REFLECTIONS_VISIBILITY

#include "reflections/lights.glsl"

const float kOpenness = 2.2; // scene units; as far as surroundings darken a surface

vec3 keptAbove(vec3 direction, vec3 geometricNormal) {
    float below = dot(direction, geometricNormal);
    return below < 5e-3 ? normalize(direction + geometricNormal * (5e-3 - below)) : direction;
}

float openness(Surface surface, vec3 origin, vec2 noise) {
    float angle = 2.0 * kPi * noise.y;
    vec3 local = vec3(sqrt(noise.x) * vec2(cos(angle), sin(angle)), sqrt(1.0 - noise.x));
    vec3 direction = keptAbove(basisAround(surface.normal) * local, surface.geometricNormal);
    return traceOccluded(origin, direction, kOpenness) ? 0.0 : 1.0;
}

// Half the width of the penumbra of something at `blocker` units from the surface, in scene units.
float penumbraOf(Light light, float range, float blocker) {
    return light.radius > 0.0 ? 0.6 * light.radius * blocker / max(range - blocker, 1e-2) : light.spread * blocker;
}

// A channel for each light, 1 where it is seen, and openness in the last. `penumbra`: of lights that something blocks,
// half the width in pixels; else 0.
vec4 visibilityOf(Surface surface, vec3 view, float distance, vec2 noise, vec2 openNoise, out vec4 penumbra) {
    vec4 seen = vec4(1.0);
    penumbra = vec4(0.0);
    vec3 origin = surface.position + surface.geometricNormal * liftAt(distance);
    vec2 disc = discPlace(noise);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        Light light = frame.lights[i];
        if (!isWorthARay(leaving(surface, view, lightAt(origin, light, vec2(0.0))))) {
            continue;
        }
        Arriving arriving = lightAt(origin, light, disc);
        float blocker = traceOccluder(origin, arriving.toLight, arriving.range);
        if (blocker >= 0.0) {
            seen[i] = 0.0;
            penumbra[i] = max(penumbraOf(light, arriving.range, blocker) / (distance * frame.camera.pixelSpread), 1e-2);
        }
    }
    seen.a = openness(surface, origin, openNoise);
    return seen;
}

#endif
