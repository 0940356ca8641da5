// The surface that each pixel shows: how a ray or the rasteriser finds it, and what later passes are told of it.
#ifndef VIEWER_VISIBLE_SURFACE
#define VIEWER_VISIBLE_SURFACE

#include "viewer/path.glsl"
#include "viewer/plane.glsl"
#include "viewer/visible_triangle.glsl"

// Where the ray of a pixel meets the plane of the triangle that the pixel shows.
Hit visibleHit(uint place, vec3 direction) {
    uvec4 visible = visibleTriangle(ivec2(pixelOf(place)));
    if (visible.x == kNothing) {
        return Hit(kNothing, 0u, 0u, vec2(0.0), 0.0);
    }
    vec3 origin = frame.camera.eye;
    Instance instance = frame.instances.at[visible.x];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + visible.y];
    uvec3 corners = CornerArray(geometry.indices).at[visible.z];
    vec3 a = toWorld(instance, positionOf(geometry, corners.x));
    vec3 e1 = toWorld(instance, positionOf(geometry, corners.y)) - a;
    vec3 e2 = toWorld(instance, positionOf(geometry, corners.z)) - a;
    vec3 p = cross(direction, e2);
    float determinant = dot(e1, p);
    float inverse = abs(determinant) > 0.0 ? 1.0 / determinant : 0.0;
    vec3 s = origin - a;
    vec3 q = cross(s, e1);
    vec2 barycentrics = clamp(vec2(dot(s, p), dot(direction, q)) * inverse, 0.0, 1.0);
    barycentrics /= max(barycentrics.x + barycentrics.y, 1.0);
    float distance = dot(a + barycentrics.x * e1 + barycentrics.y * e2 - origin, direction);
    return Hit(visible.x, visible.y, visible.z, barycentrics, distance);
}

// Where the surface at `point` was in the frame before, and by how many radians its triangle has turned since.
vec4 pointBefore(Hit hit, vec3 point) {
    if (frame.sceneMoves == 0u) {
        return vec4(point, 0.0);
    }
    Instance instance = frame.instances.at[hit.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + hit.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    vec3 now[3];
    vec3 before[3];
    for (uint corner = 0u; corner < 3u; ++corner) {
        now[corner] = transformed(instance.rows, positionIn(geometry.positions, geometry.flags, corners[corner]));
        before[corner] = transformed(frame.rowsBefore.at[hit.instance], positionIn(geometry.positionsBefore, geometry.flags, corners[corner]));
    }
    vec3 weights = weightsOf(hit.barycentrics);
    vec3 way = weights.x * (before[0] - now[0]) + weights.y * (before[1] - now[1]) + weights.z * (before[2] - now[2]);
    vec3 normal = cross(now[1] - now[0], now[2] - now[0]);
    vec3 normalBefore = cross(before[1] - before[0], before[2] - before[0]);
    float scale = length(normal) * length(normalBefore);
    float turn = scale > 0.0 ? asin(min(length(cross(normal, normalBefore)) / scale, 1.0)) : 0.0;
    return vec4(point + way, turn);
}

// What later passes need of a pixel, beside its light.
void storeSurface(uint place, Seen seen, vec3 base, vec3 matteAlbedo, vec3 share) {
    frame.planes.at[currentPlane(kPlaneSurface, place)] = packedSeen(seen);
    frame.planes.at[planePlace(kPlaneBase, place)] = vec4(base, 0.0);
    frame.planes.at[planePlace(kPlaneMatteAlbedo, place)] = vec4(matteAlbedo, 0.0);
    frame.planes.at[planePlace(kPlaneMirroredShare, place)] = vec4(share, 0.0);
}

void storePoint(uint place, vec4 pointAndTurn) {
    frame.planes.at[planePlace(kPlaneBefore, place)] = pointAndTurn;
}

// The same of a surface with its layers.
void storeLayers(uint place, Seen seen, Surface surface, Bsdf bsdf) {
    bool isClear = bsdf.lobes[kGlassLobe] + bsdf.lobes[kPaneLobe] > 0.0;
    seen.roughness = surface.coat > 0.0 ? min(surface.roughness, surface.coatRoughness) : surface.roughness;
    storeSurface(place, seen, surface.emission, bsdf.diffuse + bsdf.sheen, isClear ? vec3(1.0) : bsdf.reflected);
}

// The same of the sky.
void storeSky(uint place, vec3 direction) {
    storePoint(place, vec4(frame.camera.eye + kSkyDistance * frame.camera.nearPlane * direction, 0.0));
    storeSurface(place, Seen(-direction, -1.0, 0xffffffu, 1.0), missedLight(direction, -1.0), vec3(0.0), vec3(0.0));
}

#endif
