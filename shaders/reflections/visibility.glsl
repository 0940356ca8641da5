// What lies between a surface and each light, one ray each, and above the surface. Where that is seen by the camera, it becomes
// the visibility of each light, and ambient visibility. Colours are put to these after they were smoothed (smooth.comp.glsl,
// composite.comp.glsl): so textures and highlights stay sharp.
// The including file provides traceBlocker().
#ifndef REFLECTIONS_VISIBILITY
#define REFLECTIONS_VISIBILITY

#include "reflections/lights.glsl"

const float kOpenness = 2.2; // scene units; as far as surroundings darken a surface
const uint kOpennessChannel = 3u;

vec3 keptAbove(vec3 direction, vec3 geometricNormal) {
    float below = dot(direction, geometricNormal);
    return below < 5e-3 ? normalize(direction + geometricNormal * (5e-3 - below)) : direction;
}

// A surface that rays to the lights start from.
struct LitPoint {
    Surface surface;
    vec3 view; // to where light leaves, unit length
    vec3 origin; // a little above the surface
    vec2 disc; // place on the lamps
};

// A direction around the normal, as likely as light of a sky that is the same everywhere arrives from there.
vec3 openDirection(Surface surface, vec2 noise) {
    float angle = 2.0 * kPi * noise.y;
    vec3 local = vec3(sqrt(noise.x) * vec2(cos(angle), sin(angle)), sqrt(1.0 - noise.x));
    return keptAbove(basisAround(surface.normal) * local, surface.geometricNormal);
}

// Distances of what blocks the lights, a channel each, and in the last channel of what is above the surface. Below 0: nothing, or a
// light that is too dim there for a ray. Only where `isSeen` by the camera are distances those of the nearest, and is there a last one.
// All rays start in one call, whatever they are for: in ray queries without hardware, each call is a traversal of its own.
vec4 blockersOf(LitPoint point, bool isSeen, vec2 openNoise) {
    vec4 blockers = vec4(-1.0);
    vec3 above = openDirection(point.surface, openNoise);
    uint rays = frame.lightCount + (isSeen ? 1u : 0u);
    for (uint i = 0u; i < rays; ++i) {
        bool isLight = i < frame.lightCount;
        Arriving arriving = Arriving(above, kOpenness, vec3(0.0));
        if (isLight) {
            Arriving middle = lightAt(point.origin, frame.lights[i], vec2(0.0));
            if (!isWorthARay(leaving(point.surface, point.view, middle))) {
                continue;
            }
            arriving = lightAt(point.origin, frame.lights[i], point.disc);
        }
        uint flags = isSeen && isLight ? LVK_RAY_FLAG_NONE : LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
        blockers[isLight ? i : kOpennessChannel] = traceBlocker(point.origin, arriving.toLight, arriving.range, flags);
    }
    return blockers;
}

// Half the width of the penumbra of something at `blocker` units from the surface, in scene units.
float penumbraOf(Light light, float range, float blocker) {
    return light.radius > 0.0 ? 0.6 * light.radius * blocker / max(range - blocker, 1e-2) : light.spread * blocker;
}

// 1 where nothing blocks, for lights and openness.
vec4 visibilityOf(vec4 blockers) {
    return vec4(lessThan(blockers, vec4(0.0)));
}

// Half the widths of penumbras in pixels, of lights that something blocks; else 0.
vec4 penumbrasOf(LitPoint point, vec4 blockers, float distance) {
    vec4 penumbra = vec4(0.0);
    for (uint i = 0u; i < frame.lightCount; ++i) {
        float blocker = blockers[i];
        if (blocker >= 0.0) {
            float range = lightAt(point.origin, frame.lights[i], point.disc).range;
            float width = penumbraOf(frame.lights[i], range, blocker);
            penumbra[i] = max(width / (distance * frame.camera.pixelSpread), 1e-2);
        }
    }
    return penumbra;
}

#endif
