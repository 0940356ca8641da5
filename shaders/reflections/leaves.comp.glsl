// Drifting leaves: every one a quad that faces the camera, at a place that follows from its number and
// the phase of the animation's round. Everything happens a whole number of times in a round.
#include "reflections/noise.glsl"

layout(local_size_x = 64) in;

layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer Positions { vec3 at[]; };

const vec3 kLow = vec3(-5.5, 0.05, -27.0);
const vec3 kSize = vec3(11.0, 5.2, 29.0);

vec3 unitNoise(uint number, uint purpose) {
    return vec3(scramble(uvec3(number, purpose, 77u)) >> 8u) / 16777216.0;
}

const float kTurn = 6.2831853;

// `sunk`: how far it has come down, 0 to 1, after which it starts again above.
vec3 leafCentre(uint leaf, float sunk) {
    vec3 start = unitNoise(leaf, 0u);
    vec3 habit = unitNoise(leaf, 1u);
    vec3 place = kLow + kSize * vec3(start.x, 1.0 - sunk, start.z);
    float sway = kTurn * (frame.phase * floor(1.0 + 2.0 * habit.y) + habit.z);
    float drift = kTurn * (frame.phase * floor(1.0 + 2.0 * habit.x) + start.y);
    return place + vec3(0.35 * sin(sway), 0.08 * cos(2.0 * sway), 0.25 * cos(drift));
}

void main() {
    uint leaf = gl_GlobalInvocationID.x;
    Positions positions = Positions(uvec2(passArguments[0], passArguments[1]));
    if (leaf >= passArguments[2]) {
        return;
    }
    vec3 habit = unitNoise(leaf, 2u);
    float sunk = fract(unitNoise(leaf, 0u).y + frame.phase);
    float angle = kTurn * (habit.x + frame.phase * round(mix(-3.0, 3.0, habit.y)));
    vec3 right = normalize(frame.camera.right);
    vec3 down = normalize(frame.camera.down);
    // It grows where it starts and shrinks where it ends, so that none appears from nowhere.
    float size = mix(0.035, 0.075, habit.z) * smoothstep(0.0, 0.03, min(sunk, 1.0 - sunk));
    vec3 across = size * (cos(angle) * right + sin(angle) * down);
    vec3 along = size * (cos(angle) * down - sin(angle) * right);
    vec3 centre = leafCentre(leaf, sunk);
    positions.at[4u * leaf] = centre - across - along;
    positions.at[4u * leaf + 1u] = centre + across - along;
    positions.at[4u * leaf + 2u] = centre - across + along;
    positions.at[4u * leaf + 3u] = centre + across + along;
}
