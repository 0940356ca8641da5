// Light that arrives at a point: from the sky, from discs in it such as the sun, from lamps, and from triangles that glow.
#ifndef VIEWER_LIGHTS
#define VIEWER_LIGHTS

#include "viewer/bsdf.glsl"
#include "viewer/emitters.glsl"
#include "viewer/sky.glsl"

float discSolidAngle(Light light) {
    return 2.0 * kPi * light.cone;
}

// The radiance that gives its irradiance to a surface that faces it.
vec3 discRadiance(Light light) {
    return light.color / (kPi * light.cone * (2.0 - light.cone));
}

bool isInDisc(Light light, vec3 direction) {
    vec3 beside = direction - light.position;
    return dot(beside, beside) <= 2.0 * light.cone;
}

vec3 drawDisc(Light light, vec2 u) {
    float height = light.cone * u.x;
    float radius = sqrt(height * (2.0 - height));
    float angle = 2.0 * kPi * u.y;
    return normalize(basisOf(light.position) * vec3(radius * cos(angle), radius * sin(angle), 1.0 - height));
}

// As the extension KHR_lights_punctual has it.
vec3 lampIrradiance(Light light, vec3 direction, float distance) {
    float squared = distance * distance;
    float reach = 1.0;
    if (light.range > 0.0) {
        float share = squared / (light.range * light.range);
        reach = clamp(1.0 - share * share, 0.0, 1.0);
    }
    if (light.kind == kLightSpot) {
        float beam = clamp((dot(light.direction, -direction) - light.cone) / max(light.cosInner - light.cone, 1e-4), 0.0, 1.0);
        reach *= beam * beam;
    }
    return light.color * (reach / max(squared, 1e-12));
}

Arriving drawLight(vec3 position, float choice, vec2 u) {
    if (choice < frame.skyProbability) {
        float density;
        vec3 direction = drawSky(u, density);
        density *= frame.skyProbability;
        return Arriving(direction, kFar, density > 0.0 ? skyRadiance(direction) / density : vec3(0.0), density);
    }
    choice -= frame.skyProbability;
    if (choice < frame.emitterProbability) {
        return drawEmitter(position, choice / frame.emitterProbability, u);
    }
    choice -= frame.emitterProbability;
    uint number = 0u;
    while (number + 1u < frame.lightCount && choice >= frame.lights.at[number].probability) {
        choice -= frame.lights.at[number].probability;
        number += 1u;
    }
    if (frame.lightCount == 0u || frame.lights.at[number].probability <= 0.0) {
        return Arriving(vec3(0.0, 1.0, 0.0), kFar, vec3(0.0), 0.0);
    }
    Light light = frame.lights.at[number];
    if (light.kind == kLightDisc) {
        float density = light.probability / discSolidAngle(light);
        return Arriving(drawDisc(light, u), kFar, discRadiance(light) / density, density);
    }
    vec3 way = light.position - position;
    float distance = max(length(way), 1e-6);
    vec3 direction = way / distance;
    return Arriving(direction, distance, lampIrradiance(light, direction, distance) / light.probability, 0.0);
}

// The share of a way to find light that another way, with density `other`, does not have (Veach's power heuristic).
float powerShare(float density, float other) {
    return density * density / max(density * density + other * other, 1e-30);
}

// Light of a ray that left the scene. `density`: of its direction; below 0 where nothing else looks for that light.
vec3 missedLight(vec3 direction, float density) {
    float share = density < 0.0 ? 1.0 : powerShare(density, frame.skyProbability * skyDensity(direction));
    vec3 light = share * skyRadiance(direction);
    for (uint number = 0u; number < frame.discCount; ++number) {
        Light disc = frame.lights.at[number];
        if (isInDisc(disc, direction)) {
            float other = disc.probability / discSolidAngle(disc);
            light += (density < 0.0 ? 1.0 : powerShare(density, other)) * discRadiance(disc);
        }
    }
    return light;
}

#endif
