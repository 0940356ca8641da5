// A tile of a large triangle a workgroup, from the queue.
#include "hybrid/raster.glsl"

layout(local_size_x = 64) in;

void rasterTile(Tile tile) {
    Corners corners = cornersFromEye(tile.triangle);
    Footprint footprint = footprintOf(corners, kPixelMargin);
    Edges edges = edgesOf(corners);
    ivec2 first = ivec2(tile.corner & 0xffffu, tile.corner >> 16);
    ivec2 size = min(ivec2(kTile), footprint.last - first + 1);
    for (int i = int(gl_LocalInvocationIndex); i < size.x * size.y; i += int(gl_WorkGroupSize.x)) {
        rasterPixel(edges, corners, first + ivec2(i % size.x, i / size.x), tile.triangle);
    }
}

void main() {
    TileQueue queue = TileQueue(frame.visibility.tileQueue);
    uint count = uint(min(queue.count, uint64_t(queue.capacity)));
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        rasterTile(queue.at[i]);
    }
}
