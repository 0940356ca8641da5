// A surface in the sun and under the sky.
#include "common/phong.glsl"
#include "common/tonemap.glsl"
#include "sponza/mask.glsl"
#include "sponza/normal_mapping.glsl"

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inTexcoord;
layout(location = 3) flat in uint inMaterial;
layout(location = 4) in vec3 inColor;

layout(location = 0) out vec4 outColor;

// Share of the sun that reaches the surface: comparisons around its place in the map, each of which the sampler blends of four.
float sunlight(vec3 position, vec3 normal, float cosine) {
    // Off the surface by about a texel, more where the light grazes it.
    vec3 lifted = position + normal * (frame.sun.texelSize * (0.6 + 1.4 * (1.0 - cosine)));
    vec3 clip = sunClip(lifted);
    vec2 place = 0.5 + 0.5 * clip.xy;
    int reach = int(frame.sun.pcf);
    float lit = 0.0;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            vec2 beside = place + vec2(x, y) * frame.sun.texel;
            lit += textureBindless2DShadow(frame.sun.map, frame.sun.smp, vec3(beside, clip.z));
        }
    }
    float side = float(2 * reach + 1);
    return lit / (side * side);
}

vec3 lamplight(vec3 position, vec3 normal) {
    vec3 way = frame.sun.lamp - position;
    float relative = length(way) / frame.sun.lampReach;
    return frame.sun.lampColor * max(dot(normal, normalize(way)), 0.0) / (1.0 + relative * relative);
}

void main() {
    vec4 texel = texelOf(inMaterial, inTexcoord);
    vec3 view = normalize(frame.camera.eye - inPosition);
    vec3 smoothNormal = normalize(inNormal);
    smoothNormal = dot(smoothNormal, view) < 0.0 ? -smoothNormal : smoothNormal;
    vec3 normal = reliefNormal(inMaterial, smoothNormal, inPosition, inTexcoord);
    if (isHole(inMaterial, texel.a)) {
        discard;
    }
    Material material = frame.scene.materials.at[inMaterial];
    vec3 albedo = material.albedo * inColor * texel.rgb;
    vec3 ambient = mix(frame.sun.ambientBelow, frame.sun.ambientAbove, 0.5 + 0.5 * normal.y);
    vec3 light = material.emission + albedo * ambient;
    float cosine = dot(normal, frame.sun.direction);
    if (cosine > 0.0) {
        float steepness = max(dot(smoothNormal, frame.sun.direction), 0.0);
        vec3 sun = frame.sun.color * sunlight(inPosition, smoothNormal, steepness);
        light += sun * phong(albedo, material.specular, material.shininess, normal, view, frame.sun.direction);
    }
    light += albedo * lamplight(inPosition, normal);
    // The sky stands in for what is mirrored.
    vec3 mirrored = textureBindlessCubeLod(frame.sky, frame.skySampler, reflect(-view, normal), 0.0).rgb;
    light = mix(light, material.tint * mirrored, material.reflectivity);
    outColor = vec4(expose(light), 1.0);
}
