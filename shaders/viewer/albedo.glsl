// The share of light that a rough reflector sends on, over all directions: the table of `AlbedoTable` in the sample.
#ifndef VIEWER_ALBEDO
#define VIEWER_ALBEDO

#include "viewer/frame.glsl"

const uint kAlbedoSide = 64u;

// For a Fresnel term of f0 + (f90 - f0) * (1 - cosine)^5 the share is f0 * (x - y) + f90 * y. The share of sheen of that roughness
// is z. `cosine`: of the view.
vec3 splitAlbedo(float cosine, float roughness) {
    vec2 place = clamp(vec2(sqrt(cosine), roughness), 0.0, 1.0) * float(kAlbedoSide - 1u);
    uvec2 low = min(uvec2(place), uvec2(kAlbedoSide - 2u));
    vec2 part = place - vec2(low);
    uint first = low.y * kAlbedoSide + low.x;
    vec3 smoother = mix(frame.albedos.at[first], frame.albedos.at[first + 1u], part.x);
    vec3 rougher = mix(frame.albedos.at[first + kAlbedoSide], frame.albedos.at[first + kAlbedoSide + 1u], part.x);
    return mix(smoother, rougher, part.y);
}

// Light that a single reflection loses between microfacets comes back in the shape of that reflection (Turquin, "Practical
// multiple scattering compensation for microfacet models", 2019): the factor for a reflectance `f0`.
vec3 rescattering(vec3 f0, vec3 split) {
    return 1.0 + f0 * (1.0 / max(split.x, 1e-4) - 1.0);
}

// The share with that factor.
vec3 reflectedShare(vec3 f0, vec3 f90, vec3 split) {
    return (f0 * (split.x - split.y) + f90 * split.y) * rescattering(f0, split);
}

#endif
