// Places every sphere for the time at hand, straight from the clock, so that a frame does not depend on those before
// it; and writes what the acceleration structures are built from: a box for each sphere of glass, and the records of
// all instances (VkAccelerationStructureInstanceKHR, with the place of the structure in a list for its address).
#include "hybrid_oit/frame.glsl"

layout(local_size_x = 64) in;

const float kTurn = 6.283185307179586;

// Places in the list of structures, and offsets of their hit groups.
const uint kSolids = 0u;
const uint kGlass = 1u;
const uint kBalls = 2u;

vec3 placeOf(Motion motion, bool isGlass) {
    float angle = kTurn * fract(time * motion.orbitRate + motion.orbitPhase);
    vec3 offset = vec3(motion.orbit.x * cos(angle), 0.0, motion.orbit.y * sin(angle));
    float cycle = fract(time * motion.heightRate + motion.heightPhase);
    offset.y = motion.height * (isGlass ? sin(kTurn * cycle) : 4.0 * cycle * (1.0 - cycle));
    return motion.anchor + offset;
}

void writeRecord(uint index, vec3 center, float scale, uint customIndex, uint kind) {
    const uint everyRay = 0xffu << 24;
    frame.records.at[4u * index] = floatBitsToUint(vec4(scale, 0.0, 0.0, center.x));
    frame.records.at[4u * index + 1u] = floatBitsToUint(vec4(0.0, scale, 0.0, center.y));
    frame.records.at[4u * index + 2u] = floatBitsToUint(vec4(0.0, 0.0, scale, center.z));
    frame.records.at[4u * index + 3u] = uvec4(customIndex | everyRay, kind, kind, 0u);
}

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index == 0u) {
        writeRecord(0u, vec3(0.0), 1.0, 0u, kSolids);
        // The boxes of glass are in world space; the first of them is the sphere after the last ball.
        writeRecord(1u, vec3(0.0), 1.0, frame.ballCount, kGlass);
    }
    if (index >= frame.ballCount + frame.glassCount) {
        return;
    }
    Motion motion = frame.motions.at[index];
    bool isGlass = index >= frame.ballCount;
    vec3 center = placeOf(motion, isGlass);
    frame.spheres.at[index] = Sphere(center, motion.radius, motion.color, isGlass ? 1u : 0u);
    if (isGlass) {
        uint box = index - frame.ballCount;
        frame.boxes.at[2u * box] = center - motion.radius;
        frame.boxes.at[2u * box + 1u] = center + motion.radius;
    } else {
        writeRecord(2u + index, center, motion.radius, index, kBalls);
    }
}
