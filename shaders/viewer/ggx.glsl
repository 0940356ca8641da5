// Microfacets by GGX: distribution, shadowing (Smith) and visible normals. Directions are in the frame of the surface: z is its
// normal. `alpha` is the square of the roughness of glTF, along x and along y.
#ifndef VIEWER_GGX
#define VIEWER_GGX

#include "viewer/frame.glsl"

// Below it numbers of single precision no longer describe the peak of the distribution.
const float kSmallestAlpha = 1e-3;

float alphaOf(float roughness) {
    return max(roughness * roughness, kSmallestAlpha);
}

float ggxDistribution(vec3 h, vec2 alpha) {
    vec2 slope = h.xy / alpha;
    float d = dot(slope, slope) + h.z * h.z;
    return 1.0 / (kPi * alpha.x * alpha.y * d * d);
}

float smithLambda(vec3 w, vec2 alpha) {
    vec2 scaled = alpha * w.xy;
    return 0.5 * (sqrt(1.0 + dot(scaled, scaled) / max(w.z * w.z, 1e-12)) - 1.0);
}

float smithOne(vec3 w, vec2 alpha) {
    return 1.0 / (1.0 + smithLambda(w, alpha));
}

// Of both directions on the same side, correlated by height.
float smithTwo(vec3 a, vec3 b, vec2 alpha) {
    return 1.0 / (1.0 + smithLambda(a, alpha) + smithLambda(b, alpha));
}

// A microfacet normal as likely as it is seen from `view` (Heitz, "Sampling the GGX Distribution of Visible Normals", 2018).
vec3 visibleNormal(vec3 view, vec2 alpha, vec2 u) {
    vec3 v = normalize(vec3(alpha * view.xy, view.z));
    float length2 = dot(v.xy, v.xy);
    vec3 t1 = length2 > 0.0 ? vec3(-v.y, v.x, 0.0) * inversesqrt(length2) : vec3(1.0, 0.0, 0.0);
    vec3 t2 = cross(v, t1);
    float radius = sqrt(u.x);
    float angle = 2.0 * kPi * u.y;
    float a = radius * cos(angle);
    float b = radius * sin(angle);
    float s = 0.5 * (1.0 + v.z);
    b = mix(sqrt(max(1.0 - a * a, 0.0)), b, s);
    vec3 n = a * t1 + b * t2 + sqrt(max(1.0 - a * a - b * b, 0.0)) * v;
    return normalize(vec3(alpha * n.xy, max(n.z, 1e-6)));
}

// Density of visibleNormal.
float visibleNormalDensity(vec3 view, vec3 h, vec2 alpha) {
    return smithOne(view, alpha) * max(dot(view, h), 0.0) * ggxDistribution(h, alpha) / max(view.z, 1e-6);
}

float schlickWeight(float cosine) {
    float x = clamp(1.0 - cosine, 0.0, 1.0);
    float x2 = x * x;
    return x2 * x2 * x;
}

#endif
