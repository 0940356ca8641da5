// Shading of a sphere of tinted glass: a mirror at its rim, a dye that absorbs and scatters a little inside, a highlight
// in front and the focused sun at the back. Rays go straight through it.
#ifndef HYBRID_OIT_GLASS
#define HYBRID_OIT_GLASS

#include "hybrid_oit/sky.glsl"
#include "hybrid_oit/sphere.glsl"

struct Layer {
    vec3 radiance;
    vec3 transmittance;
};

const float kHighlight = 900.0;
const float kFocus = 26.0;
const float kScatter = 0.4;

// The entry of the ray, with the effects of `inside` units of its way in the glass.
Layer frontLayer(Sphere sphere, vec3 direction, Crossing crossing, float inside, vec3 sunlight) {
    vec3 normal = normalize(frame.camera.eye + crossing.entry * direction - sphere.center);
    vec3 mirrored = reflect(direction, normal);
    float reflectance = glassReflectance(crossing.cosine);
    vec3 passed = exp(-sphere.color * inside);
    float highlight = pow(max(dot(mirrored, frame.sunDirection), 0.0), kHighlight);
    vec3 mirror = 1.6 * skyAlong(mirrored) + 60.0 * highlight * sunlight;
    // Single scattering where the eye sees the lit side, tinted by the dye.
    float lit = 0.5 + 0.5 * dot(normal, frame.sunDirection);
    vec3 dye = exp(-0.9 * sphere.radius * sphere.color);
    vec3 scattered = kScatter * dye * (1.0 - passed) * (0.45 * skyAround(normal) + 0.5 * lit * sunlight);
    return Layer(reflectance * mirror + (1.0 - reflectance) * scattered, (1.0 - reflectance) * passed);
}

// The exit of the ray: the sun, gathered by the front of the sphere, shines on the side away from it.
Layer backLayer(Sphere sphere, vec3 direction, Crossing crossing, vec3 sunlight) {
    vec3 normal = normalize(frame.camera.eye + crossing.exit * direction - sphere.center);
    float reflectance = glassReflectance(crossing.cosine);
    float focus = pow(max(dot(normal, -frame.sunDirection), 0.0), kFocus);
    vec3 gathered = 1.5 * focus * sunlight * exp(-sphere.radius * sphere.color);
    vec3 inner = 0.5 * reflectance * skyAlong(reflect(direction, -normal));
    return Layer(gathered + inner, vec3(1.0 - reflectance));
}

#endif
