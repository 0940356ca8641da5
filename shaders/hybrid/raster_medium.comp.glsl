// Some threads a triangle that was set aside: medium ones at once, large ones are cut into tiles for the next pass.
#include "hybrid/raster.glsl"

const uint kThreads = 32u; // of a triangle
layout(local_size_x = kThreads * kSetPerGroup) in;

// Most pixels in the footprint of a medium triangle.
layout(constant_id = 0) const uint kMediumPixels = 1024u;

// The rectangle of pixels that the threads take on together.
const ivec2 kBlock = ivec2(8, 4);

void rasterMedium(SetTriangle triangle, int thread) {
    ivec2 place = ivec2(thread % kBlock.x, thread / kBlock.x);
    ivec2 first = triangle.footprint.first;
    ivec2 last = triangle.footprint.last;
    for (int y = first.y; y <= last.y; y += kBlock.y) {
        for (int x = first.x; x <= last.x; x += kBlock.x) {
            ivec2 corner = ivec2(x, y);
            bool isInside = all(lessThanEqual(corner + place, last));
            if (!isRectangleOutside(triangle.edges, corner, corner + kBlock - 1) && isInside) {
                rasterPixel(triangle.edges, triangle.corners, corner + place, triangle.triangle);
            }
        }
    }
}

// True if the tile found room.
bool isQueued(Tile tile) {
    Tiles tiles = Tiles(frame.visibility.tiles);
    uint place = atomicAdd(tiles.count, 1u);
    if (place >= frame.visibility.tileCapacity) {
        return false;
    }
    atomicMax(tiles.groups.x, min(place + 1u, kMostGroups));
    tiles.at[place] = tile;
    return true;
}

void cutLarge(SetTriangle triangle, uint number, int thread) {
    Footprint footprint = triangle.footprint;
    ivec2 counts = (footprint.last - footprint.first + kTile) / kTile;
    for (int i = thread; i < counts.x * counts.y; i += int(kThreads)) {
        ivec2 first = footprint.first + ivec2(i % counts.x, i / counts.x) * kTile;
        ivec2 last = min(first + (kTile - 1), footprint.last);
        if (isRectangleOutside(triangle.edges, first, last) ||
            isQueued(Tile(number, uint(first.x) | uint(first.y) << 16))) {
            continue;
        }
        // Slow, but right.
        for (int y = first.y; y <= last.y; ++y) {
            for (int x = first.x; x <= last.x; ++x) {
                rasterPixel(triangle.edges, triangle.corners, ivec2(x, y), triangle.triangle);
            }
        }
    }
}

void main() {
    SetTriangles list = SetTriangles(frame.visibility.setTriangles);
    uint number = gl_WorkGroupID.x * kSetPerGroup + gl_LocalInvocationIndex / kThreads;
    if (number >= min(list.count, frame.visibility.setCapacity)) {
        return;
    }
    SetTriangle triangle = list.at[number];
    int thread = int(gl_LocalInvocationIndex % kThreads);
    ivec2 size = triangle.footprint.last - triangle.footprint.first + 1;
    if (uint(size.x * size.y) <= kMediumPixels) {
        rasterMedium(triangle, thread);
    } else {
        cutLarge(triangle, number, thread);
    }
}
