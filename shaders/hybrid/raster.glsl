// Rasterising into the visibility words, and the queue of tiles of large triangles.
#ifndef HYBRID_RASTER
#define HYBRID_RASTER

#include "hybrid/coverage.glsl"
#include "hybrid/hit.glsl"

// Side of a tile in pixels.
const int kTile = 32;
// Most workgroups along one axis that every device takes.
const uint kMostGroups = 65535u;

// Distances this many floating-point numbers apart are one surface on top of another, to be told apart by the ray.
const uint kCloseUnits = 4u;

struct Tile {
    uint triangle;
    uint corner; // x in the low, y in the high half
};

layout(buffer_reference, scalar, buffer_reference_align = 8) coherent buffer TileQueue {
    uint64_t count; // of tiles that were asked for, of which `capacity` have room
    uvec3 groups; // arguments of the dispatch that works them off
    uint capacity;
    Tile at[];
};

layout(buffer_reference, scalar, buffer_reference_align = 8) buffer AtomicWords {
    uint64_t at[];
};

// Puts the smaller word into a pixel. Where the two are so close that another tracer's rounding could order them
// otherwise, the pixel is left to its ray.
void claimPixel(ivec2 pixel, Crossing crossing, uint triangle) {
    uint index = uint(pixel.y) * frame.camera.width + uint(pixel.x);
    uint bits = floatBitsToUint(crossing.distance);
    // Words only ever get smaller: one that is already nearer, even if read late, saves the atomic operation.
    uint seen = frame.visibility.words.at[index].y;
    if (seen != kNoTriangle && bits > seen + kCloseUnits) {
        return;
    }
    AtomicWords words = AtomicWords(uint64_t(frame.visibility.words));
    uint64_t mine = uint64_t(bits) << 32 | uint64_t(crossing.isDoubtful ? kAskRay : ~triangle);
    uint old = uint(atomicMin(words.at[index], mine) >> 32);
    if (old != kNoTriangle && uint(abs(int(old) - int(bits))) <= kCloseUnits) {
        atomicMin(words.at[index], uint64_t(min(old, bits)) << 32 | uint64_t(kAskRay));
    }
}

void rasterPixel(Edges edges, Corners corners, ivec2 pixel, uint triangle) {
    if (isNearby(edges, pixel)) {
        Crossing crossing = crossingAt(edges, corners, pixel);
        if (crossing.distance >= 0.0) {
            claimPixel(pixel, crossing, triangle);
        }
    }
}

#endif
