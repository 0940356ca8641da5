// Rays of a pixel, by ray queries. The hit group offset selects the shading, as hit groups do.
#define LVK_OPAQUE_TRIANGLES_ONLY
#include <lvk/ray_query.glsl>

#include "common/group_pixel.glsl"
#include "rtx_textures/surface.glsl"

Found traceNearest(vec3 origin, vec3 direction, float travelled) {
    LvkRayQuery query;
    lvkRayQueryInitialize(query, frame.tlas, LVK_RAY_FLAG_OPAQUE, 0xffu, origin, 0.0, direction, 1e4);
    while (lvkRayQueryProceed(query)) {
    }
    if (lvkRayQueryType(query, LVK_COMMITTED) == LVK_COMMITTED_NONE) {
        return Found(vec3(0.0), -1.0, vec3(0.0), 0.0);
    }
    uint customIndex = uint(lvkRayQueryInstanceCustomIndex(query, LVK_COMMITTED));
    uint primitive = uint(lvkRayQueryPrimitiveIndex(query, LVK_COMMITTED, frame.tlas));
    Found found = surfaceOf(customIndex, primitive, lvkRayQueryBarycentrics(query, LVK_COMMITTED),
                            mat3(lvkRayQueryObjectToWorld(query, LVK_COMMITTED)), direction,
                            lvkRayQueryT(query, LVK_COMMITTED), travelled);
    uint group = lvkRayQueryInstanceShaderBindingTableRecordOffset(query, LVK_COMMITTED);
    return group == kGlazed ? asGlazed(found) : asPainted(found);
}

bool reachesSky(vec3 origin, vec3 direction) {
    LvkRayQuery query;
    const uint flags = LVK_RAY_FLAG_OPAQUE | LVK_RAY_FLAG_TERMINATE_ON_FIRST_HIT;
    lvkRayQueryInitialize(query, frame.tlas, flags, 0xffu, origin, 0.0, direction, 1e4);
    while (lvkRayQueryProceed(query)) {
    }
    return lvkRayQueryType(query, LVK_COMMITTED) == LVK_COMMITTED_NONE;
}

#include "rtx_textures/shade.glsl"

#define PIXEL_FUNCTION renderPixel
#include "common/for_each_pixel.glsl"
