// Surfaces in the light of the lamp.
#include "common/tonemap.glsl"
#include "omni_shadows/haze.glsl"
#include "omni_shadows/material.glsl"
#include "omni_shadows/shadow.glsl"

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) flat in uint number;
layout(location = 0) out vec4 color;

// Ambient visibility of a position in the corner of the room.
float openness(vec3 n) {
    vec3 aside = frame.room - abs(position - vec3(0.0, 0.5 * frame.room.y, 0.0)) * vec3(1.0, 2.0, 1.0);
    vec3 shade = exp(-2.5 * max(aside * vec3(1.0, 0.5, 1.0), 0.0)) * (1.0 - abs(n));
    return (1.0 - 0.45 * shade.x) * (1.0 - 0.45 * shade.y) * (1.0 - 0.45 * shade.z);
}

vec3 litSurface(Surface surface, vec3 n, vec3 view) {
    vec3 way = frame.light - position;
    vec3 toLight = normalize(way);
    float cosine = dot(n, toLight);
    vec3 bounced = 0.0055 * frame.intensity * openness(n);
    vec3 radiance = surface.albedo * bounced * vec3(1.0, 0.85, 0.7);
    if (cosine > 0.0) {
        vec3 arriving = frame.intensity / max(dot(way, way), 1e-3) * visibility(position, n) * cosine;
        float highlight = pow(max(dot(n, normalize(toLight + view)), 0.0), surface.gloss);
        float grazing = pow(1.0 - max(dot(n, view), 0.0), 5.0);
        vec3 mirrored = mix(surface.mirrored, vec3(1.0), grazing);
        radiance += arriving * (surface.albedo / 3.1415927 + mirrored * highlight * (surface.gloss + 8.0) / 25.13);
    }
    return radiance;
}

void main() {
    Instance thing = frame.instances.at[number];
    vec3 view = normalize(frame.camera.eye - position);
    vec3 n = normalize(normal);
    vec3 facing = dot(n, view) < 0.0 ? -n : n;
    Surface surface = surfaceOf(thing, position, n);
    vec3 radiance = thing.material == kGlow ? thing.color : litSurface(surface, facing, view);
    color = vec4(expose(radiance + hazeBefore(position)), 1.0);
}
