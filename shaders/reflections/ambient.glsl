// Light from all around, where no ray says better: the sky in nine spherical harmonics.
#ifndef REFLECTIONS_AMBIENT
#define REFLECTIONS_AMBIENT

#include "reflections/frame.glsl"

// The sum of the harmonics, those of each band weighted.
vec3 harmonicSum(vec3 d, vec3 weights) {
    vec3 constant = frame.harmonics[0] * 0.282095;
    vec3 linear = (frame.harmonics[1] * d.y + frame.harmonics[2] * d.z + frame.harmonics[3] * d.x) * 0.488603;
    vec3 quadratic = (frame.harmonics[4] * d.x * d.y + frame.harmonics[5] * d.y * d.z + frame.harmonics[7] * d.x * d.z) *
                         1.092548 +
                     frame.harmonics[6] * 0.315392 * (3.0 * d.z * d.z - 1.0) +
                     frame.harmonics[8] * 0.546274 * (d.x * d.x - d.y * d.y);
    return max(constant * weights.x + linear * weights.y + quadratic * weights.z, vec3(0.0));
}

// Irradiance over pi of a surface with this normal (Ramamoorthi and Hanrahan).
vec3 ambientIrradiance(vec3 normal) {
    return harmonicSum(normal, vec3(1.0, 2.0 / 3.0, 0.25));
}

// Radiance from a direction, blurred.
vec3 ambientRadiance(vec3 direction) {
    return harmonicSum(direction, vec3(1.0, 0.8, 0.5));
}

vec3 skyRadiance(vec3 direction) {
    return textureBindlessCubeLod(frame.sky, frame.skySampler, direction, 0.0).rgb;
}

// Distant surfaces fade into the sky at the horizon.
vec3 hazed(vec3 color, vec3 direction, float distance) {
    const float kBegin = 34.0; // scene units
    const float kDepth = 75.0; // in which all but 1/e fades
    vec3 horizon = skyRadiance(normalize(vec3(direction.x, max(direction.y, 0.0) + 0.03, direction.z)));
    return mix(horizon, color, exp(-max(distance - kBegin, 0.0) / kDepth));
}

#endif
