// A tile of a large triangle a workgroup.
#include "hybrid/raster.glsl"

layout(local_size_x = 64) in;

// Side in pixels of the squares that are left out where the triangle does not reach them.
const int kBlock = 8;

void rasterBlock(SetTriangle triangle, ivec2 first, ivec2 last) {
    ivec2 size = last - first + 1;
    int count = isRectangleOutside(triangle.edges, first, last) ? 0 : size.x * size.y;
    for (int i = int(gl_LocalInvocationIndex); i < count; i += int(gl_WorkGroupSize.x)) {
        ivec2 pixel = first + ivec2(i % size.x, i / size.x);
        rasterPixel(triangle.edges, triangle.corners, pixel, triangle.triangle);
    }
}

void rasterTile(Tile tile) {
    SetTriangle triangle = SetTriangles(frame.visibility.setTriangles).at[tile.number];
    ivec2 first = ivec2(tile.corner & 0xffffu, tile.corner >> 16);
    ivec2 last = min(first + (kTile - 1), triangle.footprint.last);
    for (int y = first.y; y <= last.y; y += kBlock) {
        for (int x = first.x; x <= last.x; x += kBlock) {
            rasterBlock(triangle, ivec2(x, y), min(ivec2(x, y) + (kBlock - 1), last));
        }
    }
}

void main() {
    Tiles tiles = Tiles(frame.visibility.tiles);
    uint count = min(tiles.count, frame.visibility.tileCapacity);
    for (uint i = gl_WorkGroupID.x; i < count; i += gl_NumWorkGroups.x) {
        rasterTile(tiles.at[i]);
    }
}
