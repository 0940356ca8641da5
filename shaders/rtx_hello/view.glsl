// What the stages share: where rays go, and what they find.
layout(push_constant) uniform Push { uvec2 size; uint tlas; uint image; };

const vec3 kEye = vec3(0.0, 0.0, 3.2);

// Through one of four places in a pixel.
vec3 rayDirection(uvec2 pixel, uint place) {
    vec2 point = vec2(pixel) + vec2(0.25 + 0.5 * (place & 1u), fract(0.125 + 0.5 * place + 0.25 * (place & 1u)));
    vec2 seen = (2.0 * point - vec2(size)) / float(size.y);
    return normalize(vec3(0.55 * seen.x, -0.55 * seen.y, -1.0));
}

// A colour for each corner, brightest towards the eye.
vec3 triangleColor(vec2 barycentrics, vec3 normal) {
    vec3 corners = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
    return sqrt(corners) * mix(0.25, 1.0, abs(normalize(normal).z));
}

vec3 backdropColor(vec3 direction) {
    return vec3(0.05, 0.06, 0.09) * (1.5 + 2.0 * direction.y);
}
