// Shared by the stages: directions of rays, and their hits.
#include "common/camera.glsl"

layout(push_constant, scalar) uniform Push { Camera camera; uint tlas; uint image; };

// Through one of four places in a pixel.
vec3 rayDirection(uvec2 pixel, uint place) {
    vec2 point = vec2(pixel) + vec2(0.25 + 0.5 * (place & 1u), fract(0.125 + 0.5 * place + 0.25 * (place & 1u)));
    vec2 ndc = 2.0 * point / vec2(camera.width, camera.height) - 1.0;
    return normalize(camera.forward + ndc.x * camera.right + ndc.y * camera.down);
}

// A colour for each corner, brightest where it faces the way the first camera looks.
vec3 triangleColor(vec2 barycentrics, vec3 normal) {
    vec3 corners = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    return sqrt(corners) * mix(0.25, 1.0, abs(normalize(normal).z));
}

vec3 backdropColor(vec3 direction) {
    return vec3(0.05, 0.06, 0.09) * (1.5 + 2.0 * direction.y);
}
