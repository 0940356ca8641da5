// Light of one lamp that a surface reflects to the eye.
#include "deferred/light_output.glsl"
#include "deferred/targets.glsl"

layout(location = 0) flat in vec4 place;
layout(location = 1) flat in vec3 color;

void main() {
    Surface surface = surfaceAt(depthHere());
    vec3 way = place.xyz - surface.position;
    float squared = dot(way, way);
    float share = squared / (place.w * place.w);
    if (share >= 1.0) {
        discard;
    }
    // The inverse square, which ends at the light's reach.
    float window = (1.0 - share * share) * (1.0 - share * share);
    lit = vec4(color * window / (squared + 0.01) * reflected(surface, way * inversesqrt(squared)), 0.0);
}
