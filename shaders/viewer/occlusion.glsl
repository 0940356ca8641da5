// Whether a box in the world is hidden behind all that a depth pyramid has: its pixels, its nearest depth, and the level to look at.
// After "Practical, Dynamic Visibility for Games" (Hill and Collin, GPU Pro 2).
#ifndef VIEWER_OCCLUSION
#define VIEWER_OCCLUSION

#include "common/camera.glsl"
#include "viewer/pyramid.glsl"

// A box in the world, as seen from the eye.
struct Box {
    vec3 middle;
    vec3 axes[3]; // half of its edges
    float slack; // how far rounding may move a point
};

// Where a box is in the picture.
struct PixelBounds {
    uvec2 low;
    uvec2 high; // inclusive
    float depth; // of the nearest point
};

// Texels of a level that bounds reach over at most, along each axis.
const uint kMostTexels = 4u;
// What the depth of a fragment may be nearer than that of its triangle's corners, as a share: slivers and large triangles have steep
// planes of depth, in which rasterisers round.
const float kDepthSlack = 1.0 / 1024.0;
// What the rasteriser may move an edge by, in pixels, and more.
const float kPixelSlack = 1.0;

// False where a box reaches the near plane or what is behind it, and has no bounds.
bool boundsOf(Box box, Camera camera, out PixelBounds bounds) {
    vec3 along = vec3(dot(box.axes[0], camera.forward), dot(box.axes[1], camera.forward), dot(box.axes[2], camera.forward));
    float nearest = dot(box.middle, camera.forward) - (abs(along.x) + abs(along.y) + abs(along.z)) - box.slack;
    bounds = PixelBounds(uvec2(0u), uvec2(0u), 0.0);
    if (!(nearest > camera.nearPlane)) {
        return false;
    }
    vec2 low = vec2(1e30);
    vec2 high = vec2(-1e30);
    for (uint corner = 0u; corner < 8u; ++corner) {
        vec3 side = vec3((uvec3(corner) >> uvec3(0u, 1u, 2u)) & 1u) * 2.0 - 1.0;
        vec3 offset = box.middle + side.x * box.axes[0] + side.y * box.axes[1] + side.z * box.axes[2];
        vec2 place = vec2(dot(offset, camera.clipRight), dot(offset, camera.clipDown));
        place = place / max(dot(offset, camera.forward), nearest) - camera.shift;
        low = min(low, place);
        high = max(high, place);
    }
    vec2 size = vec2(camera.width, camera.height);
    vec2 steepest = vec2(length(camera.clipRight), length(camera.clipDown)) + max(abs(low), abs(high)) + abs(camera.shift);
    vec2 slack = 0.5 * size * steepest * (box.slack / nearest) + kPixelSlack;
    bounds.low = uvec2(clamp((0.5 * low + 0.5) * size - slack, vec2(0.0), size - 1.0));
    bounds.high = uvec2(clamp((0.5 * high + 0.5) * size + slack, vec2(0.0), size - 1.0));
    bounds.depth = camera.nearPlane / nearest * (1.0 + kDepthSlack);
    return true;
}

// The finest level of which the bounds touch few texels.
uint levelOf(PixelBounds bounds) {
    uint level = 1u;
    while (any(greaterThanEqual((bounds.high >> level) - (bounds.low >> level), uvec2(kMostTexels)))) {
        ++level;
    }
    return level;
}

#endif
