// Visibility words, and what the three passes of the compute rasteriser hand over.
#ifndef HYBRID_RASTER
#define HYBRID_RASTER

#include "hybrid/coverage.glsl"
#include "hybrid/hit.glsl"

// Distances this many floating-point numbers apart are one surface on top of another, to be told apart by the ray.
const uint kCloseUnits = 4u;

// Triangles that a workgroup of the second pass takes on at a time.
const uint kSetPerGroup = 8u;
// Most workgroups along one axis that every device takes.
const uint kMostGroups = 65535u;

// A triangle of more than a few pixels, set up. What has members begins at a multiple of 8, which glslang takes for granted
// when it stores them one by one.
struct SetTriangle {
    Corners corners;
    uint triangle;
    Edges edges;
    Footprint footprint;
};

// Triangles that the first pass sets aside for the second.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer SetTriangles {
    uvec3 groups; // of the dispatch that takes them on
    uint count; // of triangles that were found, of which there is room for `setCapacity`
    SetTriangle at[];
};

// Side of a tile in pixels.
const int kTile = 32;

struct Tile {
    uint number; // in the list of set triangles
    uint corner; // x in the low, y in the high half
};

// Tiles of large triangles, which the second pass leaves for the third.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer Tiles {
    uvec3 groups; // of the dispatch that takes them on
    uint count; // of tiles that were found, of which there is room for `tileCapacity`
    Tile at[];
};

bool isClose(uint bits, uint other) {
    return other != kNoTriangle && uint(abs(int(other) - int(bits))) <= kCloseUnits;
}

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer AtomicWords { uint64_t at[]; };

uint64_t packed(uvec2 word) {
    return uint64_t(word.y) << 32 | uint64_t(word.x);
}

// Puts the smaller word into a pixel. Where the two are so close that another tracer's rounding could order them
// otherwise, the pixel is left to its ray.
void claimPixel(ivec2 pixel, uvec2 word) {
    uint index = uint(pixel.y) * frame.camera.width + uint(pixel.x);
    // Words only ever get smaller: one that is already nearer, even if read late, saves the atomic operation.
    uint seen = frame.visibility.words.at[index].y;
    if (seen != kNoTriangle && word.y > seen + kCloseUnits) {
        return;
    }
    AtomicWords words = AtomicWords(uint64_t(frame.visibility.words));
    uint old = uint(atomicMin(words.at[index], packed(word)) >> 32);
    if (isClose(word.y, old)) {
        atomicMin(words.at[index], packed(uvec2(kAskRay, min(old, word.y))));
    }
}

uvec2 wordOf(Crossing crossing, uint triangle) {
    return uvec2(crossing.isDoubtful ? kAskRay : ~triangle, floatBitsToUint(crossing.distance));
}

void rasterPixel(Edges edges, Corners corners, ivec2 pixel, uint triangle) {
    if (isNearby(edges, pixel)) {
        Crossing crossing = crossingAt(edges, corners, pixel);
        if (crossing.distance >= 0.0) {
            claimPixel(pixel, wordOf(crossing, triangle));
        }
    }
}

#endif
