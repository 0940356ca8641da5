// A triangle a thread: small ones at once, larger ones by tiles through the queue.
#include "hybrid/raster.glsl"

layout(local_size_x = 128) in;

// Triangles whose footprint has more pixels are for the queue.
layout(constant_id = 0) const uint kSmallPixels = 32u;

void rasterRectangle(Edges edges, Corners corners, ivec2 first, ivec2 last, uint triangle) {
    for (int y = first.y; y <= last.y; ++y) {
        for (int x = first.x; x <= last.x; ++x) {
            rasterPixel(edges, corners, ivec2(x, y), triangle);
        }
    }
}

// Takes room for `count` tiles; returns how many there is room for, and in `start` where.
uint reserve(TileQueue queue, uint count, out uint start) {
    uint64_t old = atomicAdd(queue.count, uint64_t(count));
    start = uint(min(old, uint64_t(queue.capacity)));
    uint granted = min(count, queue.capacity - start);
    atomicMax(queue.groups.x, min(start + granted, kMostGroups));
    return granted;
}

// Queues the triangle's tiles; those without room are rasterised here, slowly but right.
void enqueue(Edges edges, Corners corners, Footprint footprint, uint triangle) {
    TileQueue queue = TileQueue(frame.visibility.tileQueue);
    uint count = 0u;
    for (int y = footprint.first.y; y <= footprint.last.y; y += kTile) {
        for (int x = footprint.first.x; x <= footprint.last.x; x += kTile) {
            count += isRectangleOutside(edges, ivec2(x, y), ivec2(x, y) + (kTile - 1)) ? 0u : 1u;
        }
    }
    uint next;
    uint granted = reserve(queue, count, next);
    uint end = next + granted;
    for (int y = footprint.first.y; y <= footprint.last.y; y += kTile) {
        for (int x = footprint.first.x; x <= footprint.last.x; x += kTile) {
            ivec2 first = ivec2(x, y);
            if (isRectangleOutside(edges, first, first + (kTile - 1))) {
                continue;
            }
            if (next < end) {
                queue.at[next++] = Tile(triangle, uint(x) | uint(y) << 16);
            } else {
                rasterRectangle(edges, corners, first, min(first + (kTile - 1), footprint.last), triangle);
            }
        }
    }
}

void main() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint triangle = group * gl_WorkGroupSize.x + gl_LocalInvocationIndex;
    if (triangle >= frame.visibility.triangleCount) {
        return;
    }
    Corners corners = cornersFromEye(triangle);
    Footprint footprint = footprintOf(corners, kPixelMargin);
    if (isEmpty(footprint)) {
        return;
    }
    Edges edges = edgesOf(corners);
    ivec2 size = footprint.last - footprint.first + 1;
    if (uint(size.x * size.y) <= kSmallPixels) {
        rasterRectangle(edges, corners, footprint.first, footprint.last, triangle);
    } else {
        enqueue(edges, corners, footprint, triangle);
    }
}
