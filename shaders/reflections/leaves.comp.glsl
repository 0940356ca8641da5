// Drifting leaves: every one a quad that faces the camera, at a place that follows from its number and the time.
#include "reflections/noise.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Positions {
    vec3 at[];
};

const vec3 kLow = vec3(-5.5, 0.05, -27.0);
const vec3 kSize = vec3(11.0, 5.2, 29.0);

vec3 unitNoise(uint number, uint purpose) {
    return vec3(scramble(uvec3(number, purpose, 77u)) >> 8u) / 16777216.0;
}

// A leaf sinks, sways, and starts again above; all who look at the same time see it at the same place.
vec3 leafCentre(uint leaf) {
    vec3 start = unitNoise(leaf, 0u);
    vec3 habit = unitNoise(leaf, 1u);
    float sunk = fract(start.y + frame.time * mix(0.05, 0.1, habit.x));
    vec3 place = kLow + kSize * vec3(start.x, 1.0 - sunk, start.z);
    float sway = frame.time * mix(1.0, 2.0, habit.y) + 6.3 * habit.z;
    return place + vec3(0.35 * sin(sway), 0.08 * cos(2.0 * sway), 0.25 * cos(0.8 * sway));
}

void main() {
    uint leaf = gl_GlobalInvocationID.x;
    Positions positions = Positions(uvec2(passArguments[0], passArguments[1]));
    if (leaf >= passArguments[2]) {
        return;
    }
    vec3 habit = unitNoise(leaf, 2u);
    float angle = 6.3 * habit.x + frame.time * mix(-2.0, 2.0, habit.y);
    vec3 right = normalize(frame.camera.right);
    vec3 down = normalize(frame.camera.down);
    float size = mix(0.035, 0.075, habit.z);
    vec3 across = size * (cos(angle) * right + sin(angle) * down);
    vec3 along = size * (cos(angle) * down - sin(angle) * right);
    vec3 centre = leafCentre(leaf);
    positions.at[4u * leaf] = centre - across - along;
    positions.at[4u * leaf + 1u] = centre + across - along;
    positions.at[4u * leaf + 2u] = centre - across + along;
    positions.at[4u * leaf + 3u] = centre + across + along;
}
