// The drop in the middle: a sphere with waves on it.
#include "render_to_cube_map/frame.glsl"

const uvec2 kGrid = uvec2(96, 48); // quads around and from pole to pole

// Radians of three waves along the axes. Each goes through a whole number of rounds.
vec3 waveAngle(vec3 direction) {
    return 4.0 * direction.yzx + 6.2831853 * frame.phase * vec3(1.0, 2.0, -1.0) + vec3(0.0, 2.0, 4.0);
}

float dropRadius(vec3 direction) {
    return kRadius * (1.0 + frame.waves * dot(sin(waveAngle(direction)), vec3(1.0 / 3.0)));
}

vec3 dropNormal(vec3 direction) {
    vec3 slope = kRadius * frame.waves * 4.0 / 3.0 * cos(waveAngle(direction)).zxy;
    return normalize(dropRadius(direction) * direction - (slope - direction * dot(slope, direction)));
}
