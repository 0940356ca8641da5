// The result of the hardware rasteriser for a pixel, and whether the pixel's ray must decide. Hardware places vertices on
// a grid, so near an edge it may show another triangle than the ray meets. Such pixels give themselves away: the ray
// misses the triangle or passes close to its edge, or it meets one that a pixel beside shows.
#ifndef HYBRID_HARDWARE_VISIBILITY
#define HYBRID_HARDWARE_VISIBILITY

#include "hybrid/coverage.glsl"
#include "hybrid/hit.glsl"

// Distances that are closer, as shares, are one surface on top of another: only the ray tells which one it meets.
const float kSameDistance = 1.0 / 131072.0;

const ivec2 kBeside[8] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1), ivec2(-1, -1), ivec2(1, -1),
                                 ivec2(-1, 1), ivec2(1, 1));

uint rasterisedTriangle(ivec2 pixel) {
    return textureBindlessFetchU2D(frame.visibility.image, pixel, 0).x;
}

Crossing triangleCrossing(vec3 direction, uint triangle) {
    Corners corners = cornersFromEye(triangle);
    float away = max(largest(corners.a), max(largest(corners.b), largest(corners.c)));
    float size = max(largest(corners.b - corners.a), largest(corners.c - corners.a));
    return crossingAlong(direction, corners, doubtOf(away, size));
}

// True if the ray along `direction` meets one of the triangles beside `pixel` no farther away than `limit`.
bool meetsNeighbour(ivec2 pixel, vec3 direction, uint triangle, float limit) {
    ivec2 last = ivec2(frame.camera.width, frame.camera.height) - 1;
    uint seen = kNoTriangle;
    for (int i = 0; i < 8; ++i) {
        uint other = rasterisedTriangle(clamp(pixel + kBeside[i], ivec2(0), last));
        if (other == triangle || other == seen || other == kNoTriangle) {
            continue;
        }
        seen = other;
        float distance = triangleCrossing(direction, other).distance;
        if (distance >= 0.0 && distance <= limit) {
            return true;
        }
    }
    return false;
}

// The triangle that the pixel shows; kNoTriangle also where the ray must say, and then `isInDoubt`.
uint hardwareTriangle(ivec2 pixel, vec3 direction, out bool isInDoubt) {
    uint triangle = rasterisedTriangle(pixel);
    float limit = 1e30;
    isInDoubt = false;
    if (triangle != kNoTriangle) {
        Crossing crossing = triangleCrossing(direction, triangle);
        isInDoubt = crossing.isDoubtful || crossing.distance < 0.0;
        limit = crossing.distance * (1.0 + kSameDistance);
    }
    isInDoubt = isInDoubt || meetsNeighbour(pixel, direction, triangle, limit);
    return isInDoubt ? kNoTriangle : triangle;
}

#endif
