// Rays of a pixel, by ray queries.
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>
#include "common/group_pixel.glsl"
#include "rtx_hello/view.glsl"

vec3 colorAlong(vec3 direction) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, tlas, LVK_RAY_FLAG_OPAQUE, 0xffu, camera.eye, 0.0, direction, 99.0);
    while (lvkRayQueryProceed(query)) {
    }
    if (lvkRayQueryType(query, LVK_COMMITTED) == LVK_COMMITTED_NONE) {
        return backdropColor(direction);
    }
    vec3 normal = lvkRayQueryObjectToWorld(query, LVK_COMMITTED)[2];
    return triangleColor(lvkRayQueryBarycentrics(query, LVK_COMMITTED), normal);
}

void renderPixel(uvec2 pixel) {
    vec3 sum = vec3(0.0);
    for (uint place = 0u; place < 4u; ++place) {
        sum += colorAlong(rayDirection(pixel, place));
    }
    imageStore(kImages2D[image], ivec2(pixel), vec4(sum / 4.0, 1.0));
}

void main() {
    uvec2 first = groupPixel();
    [[dont_unroll]] for (uint i = 0u; i < kGroupPixels; ++i) {
        uvec2 pixel = first + groupStep(i);
        if (pixel.x < camera.width && pixel.y < camera.height) {
            renderPixel(pixel);
        }
    }
}
