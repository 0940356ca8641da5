// Sky visibility of a point past spheres and blocks, in closed form: form factors instead of rays.
#ifndef HYBRID_OIT_OCCLUSION
#define HYBRID_OIT_OCCLUSION

#include "hybrid_oit/frame.glsl"

// Share of the cosine-weighted half space around `normal` that a sphere covers.
float sphereShare(vec3 position, vec3 normal, vec3 center, float radius) {
    vec3 toCenter = center - position;
    float squaredDistance = max(dot(toCenter, toCenter), radius * radius);
    float cosine = max(dot(normal, toCenter) * inversesqrt(squaredDistance), 0.0);
    return cosine * radius * radius / squaredDistance;
}

// One side of a polygon in Lambert's formula for its form factor.
float edgeShare(vec3 normal, vec3 a, vec3 b) {
    vec3 axis = cross(a, b);
    float squaredSine = dot(axis, axis);
    float angle = atan(sqrt(squaredSine), dot(a, b));
    return angle * dot(normal, axis) * inversesqrt(max(squaredSine, 1e-24));
}

// The same of the part of a rectangle above the horizon. Two of its sides cross the horizon or none; between the
// crossings the part is closed along the horizon.
float rectangleShare(vec3 normal, vec3 corners[4]) {
    float sum = 0.0;
    vec3 down = vec3(0.0);
    vec3 up = vec3(0.0);
    for (int i = 0; i < 4; i++) {
        vec3 a = corners[i];
        vec3 b = corners[(i + 1) & 3];
        float heightA = dot(a, normal);
        float heightB = dot(b, normal);
        if (heightA < 0.0 && heightB < 0.0) {
            continue;
        }
        vec3 crossing = mix(a, b, heightA / (heightA - heightB));
        if (heightA < 0.0) {
            up = crossing;
            a = crossing;
        } else if (heightB < 0.0) {
            down = crossing;
            b = crossing;
        }
        sum += edgeShare(normal, a, b);
    }
    return abs(sum + edgeShare(normal, down, up)) / 6.283185307;
}

float blockShare(vec3 position, vec3 normal, Block block) {
    float share = 0.0;
    for (int axis = 0; axis < 3; axis++) {
        float low = block.low[axis] - position[axis];
        float high = block.high[axis] - position[axis];
        // The side towards the point; none where the point is between both.
        float plane = low > 1e-3 ? low : high;
        if (low <= 1e-3 && high >= -1e-3) {
            continue;
        }
        int u = (axis + 1) % 3;
        int v = (axis + 2) % 3;
        vec3 corners[4];
        for (int i = 0; i < 4; i++) {
            corners[i][axis] = plane;
            corners[i][u] = ((i & 1) == (i >> 1) ? block.low[u] : block.high[u]) - position[u];
            corners[i][v] = ((i >> 1) == 0 ? block.low[v] : block.high[v]) - position[v];
        }
        share += rectangleShare(normal, corners);
    }
    return share;
}

// Light that occluding blocks reflect, for their albedo and that of the floor between them.
const float kGivenBack = 0.3;

// Transmitted share of the sky's light, by colour: balls and blocks occlude it, glass tints it.
vec3 skyVisibility(vec3 position, vec3 normal) {
    vec3 visible = vec3(1.0);
    for (uint i = 0u; i < frame.ballCount + frame.glassCount; i++) {
        Sphere sphere = frame.spheres.at[i];
        float share = sphereShare(position, normal, sphere.center, sphere.radius);
        vec3 passed = sphere.isGlass != 0u ? 0.9 * exp(-1.4 * sphere.radius * sphere.color) : vec3(0.0);
        visible *= 1.0 - share * (1.0 - passed);
    }
    float blocked = 0.0;
    for (uint i = 0u; i < frame.blockCount; i++) {
        blocked += blockShare(position, normal, frame.blocks.at[i]);
    }
    return visible * mix(kGivenBack, 1.0, max(1.0 - blocked, 0.0));
}

#endif
