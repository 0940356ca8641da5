// Rasterising into the visibility words, and the queue of tiles of large triangles.
#ifndef HYBRID_RASTER
#define HYBRID_RASTER

#include "hybrid/coverage.glsl"

// Side of a tile in pixels.
const int kTile = 32;
// Most workgroups along one axis that every device takes.
const uint kMostGroups = 65535u;

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

void claimPixel(ivec2 pixel, float depth, uint triangle) {
    uint index = uint(pixel.y) * frame.camera.width + uint(pixel.x);
    uint bits = floatBitsToUint(depth);
    // Words only ever get smaller: one that is already nearer, even if read late, saves the atomic operation.
    if (bits <= frame.visibility.words.at[index].y) {
        AtomicWords words = AtomicWords(uint64_t(frame.visibility.words));
        atomicMin(words.at[index], uint64_t(bits) << 32 | uint64_t(triangle));
    }
}

void rasterPixel(Edges edges, Corners corners, ivec2 pixel, uint triangle) {
    float depth = depthAt(edges, corners, pixel);
    if (depth >= 0.0) {
        claimPixel(pixel, depth, triangle);
    }
}

#endif
