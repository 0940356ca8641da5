// Colour and light of what is nearest.
#include "triplanar/triplanar.glsl"
#include "common/tonemap.glsl"
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 place;
layout(location = 3) flat in uint number;
layout(location = 0) out vec4 result;

const vec3 kToSun = vec3(0.4851, 0.7276, 0.4851);

// The share of the sun and of the sky that the other bodies let pass, as if they were balls.
vec2 open(vec3 outwards) {
    vec2 passed = vec2(1.0);
    for (uint other = 0u; other < frame.bodyCount; ++other) {
        Body body = frame.bodies.at[other];
        vec3 offset = body.place - place;
        float along = dot(offset, kToSun);
        if (other == number || body.radius == 0.0) {
            continue;
        }
        float beside = length(offset - along * kToSun) / body.radius;
        passed.x *= along > 0.0 ? smoothstep(0.8, 1.1, beside) : 1.0;
        float squared = max(dot(offset, offset) / (body.radius * body.radius), 1.0);
        passed.y *= 1.0 - max(dot(outwards, normalize(offset)), 0.0) / squared;
    }
    return passed;
}

void main() {
    Body body = frame.bodies.at[number];
    vec3 inModel = normalize(normal);
    vec3 outwards = turned(body, inModel);
    bool hasAngles = frame.byAngles == 1u && body.radius > 0.0;
    vec3 albedo = hasAngles ? byAngles(body, position, inModel) : byPlanes(body, position, inModel);
    vec2 passed = open(outwards);
    vec3 sky = mix(vec3(0.16, 0.14, 0.12), vec3(0.36, 0.42, 0.52), 0.5 + 0.5 * outwards.y);
    vec3 light = sky * passed.y + vec3(2.0, 1.8, 1.5) * passed.x * max(dot(outwards, kToSun), 0.0);
    float haze = 1.0 - exp(-0.003 * dot(place, place));
    result = vec4(mix(expose(albedo * light), kBackdrop, haze), 1.0);
}
