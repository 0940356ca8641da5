// Materials of surfaces.
#ifndef OMNI_SHADOWS_MATERIAL
#define OMNI_SHADOWS_MATERIAL

#include "omni_shadows/frame.glsl"

struct Surface {
    vec3 albedo;
    vec3 mirrored; // of light that comes straight
    float gloss; // exponent
};

// Share of the odd tiles in a pixel: the checkerboard, averaged over the pixel's width.
float checkers(vec2 place) {
    vec2 width = max(fwidth(place), 1e-4);
    vec2 mean = 2.0 * (abs(fract((place - 0.5 * width) * 0.5) - 0.5) - abs(fract((place + 0.5 * width) * 0.5) - 0.5)) / width;
    return 0.5 - 0.5 * mean.x * mean.y;
}

// Dark below the height of a chair, with a line above.
vec3 wallColor(vec3 color, float height) {
    float width = max(fwidth(height), 1e-4);
    float dado = 1.0 - smoothstep(-width, width, height - 1.05);
    float line = smoothstep(-width, width, height - 1.12) * (1.0 - smoothstep(-width, width, height - 1.15));
    return mix(mix(color, vec3(0.07, 0.14, 0.17), dado), vec3(0.55, 0.36, 0.13), line);
}

Surface surfaceOf(Instance thing, vec3 position, vec3 normal) {
    // Before any branch: they look at neighbouring pixels.
    float odd = checkers(position.xz * 1.6);
    vec3 wall = wallColor(thing.color, position.y);
    Surface surface = Surface(thing.color, vec3(0.02), 20.0);
    if (thing.material == kTiles) {
        surface = Surface(mix(vec3(0.42, 0.36, 0.29), vec3(0.08, 0.1, 0.11), odd), vec3(0.05), 220.0);
    } else if (thing.material == kMetal) {
        surface = Surface(0.25 * thing.color, thing.color, 40.0);
    } else if (thing.material == kGlaze) {
        surface = Surface(thing.color, vec3(0.05), 160.0);
    } else if (abs(normal.y) < 0.5) {
        surface.albedo = wall;
    }
    return surface;
}

#endif
