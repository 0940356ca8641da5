// Panes: thin and smooth surfaces, through which light goes straight on.
#ifndef VIEWER_THIN
#define VIEWER_THIN

#include "viewer/albedo.glsl"
#include "viewer/surface.glsl"

// Above this roughness light scatters on its way through.
const float kPaneRoughness = 0.05;
// Reflectance of a clear coat straight on: its index of refraction is 1.5.
const float kCoatF0 = 0.04;

bool isPane(Surface surface) {
    return (surface.flags & kThin) != 0u && surface.transmission > 0.0 && surface.roughness <= kPaneRoughness;
}

// The share of light that a clear coat leaves to what lies below it, as seen along `view`.
float belowCoat(Surface surface, vec3 view) {
    if (surface.coat <= 0.0) {
        return 1.0;
    }
    vec3 split = splitAlbedo(abs(dot(surface.coatNormal, view)), surface.coatRoughness);
    return 1.0 - surface.coat * reflectedShare(vec3(kCoatF0), vec3(1.0), split).x;
}

// The share of light that goes straight on through a pane.
vec3 paneTransmittance(Surface surface, vec3 view) {
    vec3 split = splitAlbedo(abs(dot(surface.normal, view)), surface.roughness);
    vec3 kept = max(1.0 - reflectedShare(surface.f0, vec3(surface.f90), split), 0.0);
    return belowCoat(surface, view) * (1.0 - surface.metalness) * surface.transmission * kept * surface.baseColor;
}

#endif
