// Light from nowhere in particular and of the moon, and the night sky where there is no surface.
#include "deferred/light_output.glsl"
#include "deferred/targets.glsl"


const vec3 kToMoon = normalize(vec3(0.35, 0.8, 0.45));

vec3 sky(float height) {
    return mix(vec3(0.017, 0.023, 0.046), vec3(0.0016, 0.0028, 0.009), sqrt(clamp(height, 0.0, 1.0)));
}

// An approximation of the hall for mirrors: the glimmer of all lights near the ground, and the sky above.
vec3 surroundings(vec3 direction) {
    vec3 hall = mix(vec3(0.05, 0.034, 0.026), vec3(0.1, 0.072, 0.066), smoothstep(-0.9, 0.0, direction.y));
    return mix(hall, sky(direction.y), smoothstep(0.0, 0.55, direction.y));
}

vec3 lightOf(Surface surface) {
    float above = 0.5 + 0.5 * surface.normal.y;
    vec3 around = mix(vec3(0.016, 0.011, 0.009), vec3(0.018, 0.024, 0.042), above);
    vec3 moon = vec3(0.05, 0.065, 0.1) * reflected(surface, kToMoon);
    vec3 mirrored = surface.metalness * surface.albedo * surroundings(reflect(-surface.toEye, surface.normal));
    return (1.0 - surface.metalness) * surface.albedo * around + mirrored + moon;
}

void main() {
    float depth = depthHere();
    // Read before pixels go different ways: where one of four has left, some drivers lose the numbers of textures.
    Surface surface = surfaceAt(depth);
    if (depth == 0.0) {
        lit = vec4(sky(-surface.toEye.y), 0.0);
    } else {
        lit = vec4(lightOf(surface), 0.0);
    }
}
