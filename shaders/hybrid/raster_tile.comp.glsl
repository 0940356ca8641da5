// A tile of a large triangle a workgroup, from the queue.
#include "hybrid/raster.glsl"

layout(local_size_x = 64) in;

// Side in pixels of the squares that are left out where the triangle does not reach them.
const int kBlock = 8;

void rasterBlock(Edges edges, Corners corners, ivec2 first, ivec2 last, uint triangle) {
    ivec2 size = last - first + 1;
    int count = isRectangleOutside(edges, first, last) ? 0 : size.x * size.y;
    for (int i = int(gl_LocalInvocationIndex); i < count; i += int(gl_WorkGroupSize.x)) {
        rasterPixel(edges, corners, first + ivec2(i % size.x, i / size.x), triangle);
    }
}

void rasterTile(Tile tile) {
    Corners corners = cornersFromEye(tile.triangle);
    Footprint footprint = footprintOf(corners, kPixelMargin);
    Edges edges = edgesOf(corners);
    ivec2 first = ivec2(tile.corner & 0xffffu, tile.corner >> 16);
    ivec2 last = min(first + (kTile - 1), footprint.last);
    for (int y = first.y; y <= last.y; y += kBlock) {
        for (int x = first.x; x <= last.x; x += kBlock) {
            rasterBlock(edges, corners, ivec2(x, y), min(ivec2(x, y) + (kBlock - 1), last), tile.triangle);
        }
    }
}

void main() {
    TileQueue queue = TileQueue(frame.visibility.tileQueue);
    uint count = uint(min(queue.count, uint64_t(queue.capacity)));
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        rasterTile(queue.at[i]);
    }
}
