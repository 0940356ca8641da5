// The surface data that lighting reads at its own pixel: from the attachments of the pass itself, or in a later pass
// it from textures.
#ifndef DEFERRED_TARGETS
#define DEFERRED_TARGETS

#include "deferred/frame.glsl"

#ifdef ONE_PASS
LVK_INPUT(0, subpassInput, gAlbedo);
LVK_INPUT(1, subpassInput, gNormal);
LVK_DEPTH_INPUT(subpassInput, gDepth);
#define TARGET(input, name) subpassLoad(input)
#else
#define TARGET(input, name) \
    texelFetch(sampler2D(kTextures2D[frame.name], kSamplers[frame.nearest]), ivec2(gl_FragCoord.xy), 0)
#endif

vec4 albedoAndRoughness() { return TARGET(gAlbedo, albedo); }
vec4 normalAndMetalness() { return TARGET(gNormal, normal); }

// Reversed: 1 near, and 0 where nothing was drawn.
float depthHere() { return TARGET(gDepth, depth).r; }

// From the eye through the pixel, as long as `camera.forward` is deep.
vec3 wayThrough(vec2 pixel) {
    Camera camera = frame.camera;
    vec2 ndc = 2.0 * pixel / vec2(camera.width, camera.height) - 1.0;
    return camera.forward + ndc.x * camera.right + ndc.y * camera.down;
}

struct Surface {
    vec3 position;
    vec3 normal;
    vec3 toEye;
    vec3 albedo;
    float roughness;
    float metalness;
};

Surface surfaceAt(float depth) {
    vec4 albedo = albedoAndRoughness();
    vec4 normal = normalAndMetalness();
    vec3 way = wayThrough(gl_FragCoord.xy);
    Surface surface;
    surface.position = frame.camera.eye + frame.camera.nearPlane / depth * way;
    surface.normal = normalize(normal.xyz);
    surface.toEye = -normalize(way);
    surface.albedo = albedo.rgb * albedo.rgb; // stored as its root
    surface.roughness = albedo.a;
    surface.metalness = normal.w;
    return surface;
}

// Reflection of light from a direction to the eye: a diffuse part and GGX highlights.
vec3 reflected(Surface surface, vec3 toLight) {
    float facing = dot(surface.normal, toLight);
    if (facing <= 0.0) {
        return vec3(0.0);
    }
    vec3 middle = normalize(toLight + surface.toEye);
    float alpha = max(surface.roughness * surface.roughness, 0.004);
    float seen = max(dot(surface.normal, surface.toEye), 1e-3);
    float peak = clamp(dot(surface.normal, middle), 0.0, 1.0);
    float spread = peak * peak * (alpha * alpha - 1.0) + 1.0;
    float distribution = alpha * alpha / (3.14159265 * spread * spread);
    float masking = 0.5 / mix(2.0 * facing * seen, facing + seen, alpha);
    vec3 straight = mix(vec3(0.04), surface.albedo, surface.metalness);
    vec3 fresnel = straight + (1.0 - straight) * pow(1.0 - clamp(dot(middle, toLight), 0.0, 1.0), 5.0);
    vec3 diffuse = surface.albedo * (1.0 - surface.metalness) / 3.14159265;
    return facing * (diffuse * (1.0 - fresnel) + distribution * masking * fresnel);
}

#endif
