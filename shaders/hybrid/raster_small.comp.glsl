// A triangle a thread: small ones at once, the others are set up for the next pass.
#include "hybrid/raster.glsl"

layout(local_size_x = 128) in;

// Most pixels in the footprint of a small triangle.
layout(constant_id = 0) const uint kSmallPixels = 16u;

void rasterFootprint(Edges edges, Corners corners, Footprint footprint, uint triangle) {
    for (int y = footprint.first.y; y <= footprint.last.y; ++y) {
        for (int x = footprint.first.x; x <= footprint.last.x; ++x) {
            rasterPixel(edges, corners, ivec2(x, y), triangle);
        }
    }
}

// True if the list had room for the triangle.
bool isSetAside(SetTriangles list, SetTriangle triangle) {
    uint place = atomicAdd(list.count, 1u);
    if (place >= frame.visibility.setCapacity) {
        return false;
    }
    if (place % kSetPerGroup == 0u) {
        atomicAdd(list.groups.x, 1u);
    }
    list.at[place] = triangle;
    return true;
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
    SetTriangles list = SetTriangles(frame.visibility.setTriangles);
    bool isSmall = uint(size.x * size.y) <= kSmallPixels;
    if (isSmall || !isSetAside(list, SetTriangle(corners, triangle, edges, footprint))) {
        rasterFootprint(edges, corners, footprint, triangle);
    }
}
