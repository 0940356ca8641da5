// The triangle that a pixel shows. Occlusion culling draws in two passes, each with targets of its own: the nearer of both is seen.
// Where both are at the same depth, it is the one that a single pass would have drawn first, so that the picture does not depend on
// what was visible before.
#ifndef VIEWER_VISIBLE_TRIANGLE
#define VIEWER_VISIBLE_TRIANGLE

#include "viewer/frame.glsl"

// True if there is a rasteriser; else rays find what pixels show.
bool isRasterised() {
    return frame.visible1.triangles != kNoTexture;
}

// True if a single pass draws `a` before `b`: meshes in the order of their instances, of a mesh all instances of a geometry.
bool isDrawnBefore(uvec4 a, uvec4 b) {
    bool sameMesh = frame.instances.at[a.x].firstGeometry == frame.instances.at[b.x].firstGeometry;
    return sameMesh && a.y != b.y ? a.y < b.y : a.x < b.x;
}

// Instance, geometry and primitive.
uvec4 visibleTriangle(ivec2 pixel) {
    uvec4 first = texelFetch(kTexturesU2D[frame.visible1.triangles], pixel, 0);
    if (frame.visible2.triangles == kNoTexture) {
        return first;
    }
    float depth2 = texelFetch(kTextures2D[frame.visible2.depth], pixel, 0).r;
    if (depth2 == 0.0) {
        return first;
    }
    float depth1 = texelFetch(kTextures2D[frame.visible1.depth], pixel, 0).r;
    if (depth2 < depth1) {
        return first;
    }
    uvec4 second = texelFetch(kTexturesU2D[frame.visible2.triangles], pixel, 0);
    return depth2 > depth1 || isDrawnBefore(second, first) ? second : first;
}

#endif
