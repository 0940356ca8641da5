// The BRDF of surfaces: Lambert and GGX by metalness and roughness.
#ifndef REFLECTIONS_REFLECTANCE
#define REFLECTIONS_REFLECTANCE

#include "reflections/surface.glsl"

const float kPi = 3.14159265;

vec3 normalReflectance(Surface surface) {
    return mix(vec3(0.05), surface.albedo, surface.metalness);
}

vec3 fresnelSchlick(vec3 normalIncidence, float cosine) {
    return normalIncidence + (1.0 - normalIncidence) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
}

// Light towards `view` of one unit of irradiance over pi from `light`.
vec3 scatter(Surface surface, vec3 view, vec3 light) {
    vec3 halfway = normalize(view + light);
    float nl = max(dot(surface.normal, light), 0.0);
    float nv = max(dot(surface.normal, view), 1e-3);
    float nh = max(dot(surface.normal, halfway), 0.0);
    float alpha = max(surface.roughness * surface.roughness, 4e-3);
    float a2 = alpha * alpha;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    // Smith's masking with both directions, divided by 4 nl nv.
    float visibility = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2) + 1e-5);
    vec3 fresnel = fresnelSchlick(normalReflectance(surface), dot(view, halfway));
    vec3 diffuse = surface.albedo * (1.0 - surface.metalness) * (1.0 - fresnel);
    // The lobe times pi, which the irradiance was divided by.
    return nl * (diffuse + min(a2 / (d * d) * visibility, 40.0) * fresnel);
}

// Share of light from all around the mirror direction that leaves towards the viewer (Karis, "Physically Based
// Shading on Mobile").
vec3 environmentReflectance(Surface surface, float nv) {
    vec4 r = surface.roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 scaleAndBias = vec2(-1.04, 1.04) * a + r.zw;
    return normalReflectance(surface) * scaleAndBias.x + scaleAndBias.y;
}

// A microfacet normal that is seen from `view`, around the axis z (Heitz, "Sampling the GGX Distribution of Visible
// Normals").
vec3 visibleNormal(vec3 view, float alpha, vec2 u) {
    vec3 stretched = normalize(vec3(alpha * view.xy, view.z));
    float squared = dot(stretched.xy, stretched.xy);
    vec3 across = squared > 0.0 ? vec3(-stretched.y, stretched.x, 0.0) * inversesqrt(squared) : vec3(1.0, 0.0, 0.0);
    vec3 along = cross(stretched, across);
    float radius = sqrt(u.x);
    float angle = 2.0 * kPi * u.y;
    float x = radius * cos(angle);
    float lean = 0.5 * (1.0 + stretched.z);
    float y = mix(sqrt(1.0 - x * x), radius * sin(angle), lean);
    vec3 normal = x * across + y * along + sqrt(max(1.0 - x * x - y * y, 0.0)) * stretched;
    return normalize(vec3(alpha * normal.xy, max(normal.z, 1e-4)));
}

#endif
