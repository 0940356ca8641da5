// The light of what each pixel shows, of one sample: a shadow ray, and a path in a direction that the surface prefers, which may end with
// the light of the radiance cache. Matte layers and all others are kept apart, without their colours, for the filter.
#ifndef VIEWER_VISIBLE_LIGHT
#define VIEWER_VISIBLE_LIGHT

#include "viewer/path.glsl"
#include "viewer/plane.glsl"
#include "viewer/radiance_cache.glsl"
#include "viewer/visible_triangle.glsl"

// Exposed light that a path brings in the first frame of a still at most. A brighter path would leave a bright spot for many frames.
const float kBrightestPath = 12.0;

// Where the ray of a pixel meets the plane of the triangle that the pixel shows.
Hit visibleHit(uint place, vec3 direction) {
    uvec4 visible = visibleTriangle(ivec2(place % frame.camera.width, place / frame.camera.width));
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

// Where the surface at `point` was in the frame before.
vec3 pointBefore(Hit hit, vec3 point) {
    Geometry geometry = frame.geometries.at[frame.instances.at[hit.instance].firstGeometry + hit.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    vec3 weights = weightsOf(hit.barycentrics);
    vec3 now = vec3(0.0);
    vec3 before = vec3(0.0);
    for (uint corner = 0u; corner < 3u; ++corner) {
        now += weights[corner] * positionIn(geometry.positions, geometry.flags, corners[corner]);
        before += weights[corner] * positionIn(geometry.positionsBefore, geometry.flags, corners[corner]);
    }
    vec3 way = transformed(frame.rowsBefore.at[hit.instance], before) - transformed(frame.instances.at[hit.instance].rows, now);
    return frame.sceneMoves != 0u ? point + way : point;
}

// Light that a path brings to the eye. The bound grows with the frames of a still, by the fourth root of their number: a spot fades
// before it is seen, and the mean still comes to that of all paths.
vec3 boundedLight(vec3 light) {
    float bound = kBrightestPath * sqrt(sqrt(1.0 + float(frame.stillCount)));
    float most = largest(light) * frame.exposure;
    return most > bound ? light * (bound / most) : light;
}

// What later passes need of a pixel, beside its light.
void storeSurface(uint place, Seen seen, vec3 base, vec3 matteAlbedo, vec3 share) {
    frame.planes.at[currentPlane(kPlaneSurface, place)] = packedSeen(seen);
    frame.planes.at[planePlace(kPlaneBase, place)] = vec4(base, 0.0);
    frame.planes.at[planePlace(kPlaneMatteAlbedo, place)] = vec4(matteAlbedo, 0.0);
    frame.planes.at[planePlace(kPlaneMirroredShare, place)] = vec4(share, 0.0);
}

void storePoint(uint place, vec3 point) {
    frame.planes.at[planePlace(kPlaneBefore, place)] = vec4(point, 0.0);
}

// What the surface of a pixel returns of its own shadow ray, and of the light of the path beyond. It waits for the end of the path in
// planes that the filter writes later.
struct FirstLight {
    vec3 matte;
    vec3 mirrored;
    vec3 matteWeight;
    vec3 mirroredWeight;
};

const FirstLight kNoLight = FirstLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
const uint kPlaneMatteWeight = kPlaneMatte + 1u;
const uint kPlaneMirroredWeight = kPlaneMirrored + 1u;

void storeFirst(uint place, FirstLight first) {
    frame.planes.at[planePlace(kPlaneMatte, place)] = vec4(first.matte, 0.0);
    frame.planes.at[planePlace(kPlaneMirrored, place)] = vec4(first.mirrored, 0.0);
    frame.planes.at[planePlace(kPlaneMatteWeight, place)] = vec4(first.matteWeight, 0.0);
    frame.planes.at[planePlace(kPlaneMirroredWeight, place)] = vec4(first.mirroredWeight, 0.0);
}

FirstLight storedFirst(uint place) {
    return FirstLight(frame.planes.at[planePlace(kPlaneMatte, place)].rgb, frame.planes.at[planePlace(kPlaneMirrored, place)].rgb,
                      frame.planes.at[planePlace(kPlaneMatteWeight, place)].rgb,
                      frame.planes.at[planePlace(kPlaneMirroredWeight, place)].rgb);
}

// Width of the cone of a pixel by which textures are read, in pixels: antialiasing takes the mean of many places in a pixel, so that mip
// levels may be one finer.
const float kConeOfPixel = 0.5;

Path beginPath(uvec2 pixel, inout Random random) {
    Path path = cameraPath(cameraDirection(frame.camera, pixel));
    path.spread = kConeOfPixel * frame.camera.pixelSpread;
    if (usesCache() && isUpdating(pixelPlace(ivec2(pixel)))) {
        beginUpdates(pixelPlace(ivec2(pixel)));
    }
    return path;
}

// A pixel that shows the sky.
void endInSky(uint place, vec3 direction) {
    storePoint(place, frame.camera.eye + kSkyDistance * frame.camera.nearPlane * direction);
    storeSurface(place, Seen(-direction, -1.0, 0xffffffu, 1.0), missedLight(direction, -1.0), vec3(0.0), vec3(0.0));
    storeFirst(place, kNoLight);
}

// A pixel that shows an unlit surface.
void endUnlit(uint place, Seen seen, vec3 color) {
    storeSurface(place, seen, color, vec3(0.0), vec3(0.0));
    storeFirst(place, kNoLight);
}

FirstLight leaveFirst(inout Path path, Surface surface, Bounce bounce, Seen seen, uint place) {
    Bsdf bsdf = bounce.bsdf;
    vec3 weight = bounce.scattered.weight;
    bool isClear = bsdf.lobes[kGlassLobe] + bsdf.lobes[kPaneLobe] > 0.0;
    seen.roughness = surface.coat > 0.0 ? min(surface.roughness, surface.coatRoughness) : surface.roughness;
    storeSurface(place, seen, surface.emission, bsdf.diffuse + bsdf.sheen, isClear ? vec3(1.0) : bsdf.reflected);
    path.throughput = vec3(any(greaterThan(weight, vec3(0.0))));
    ShadowRay shadow = bounce.shadow;
    return FirstLight(shadow.matte, shadow.light - shadow.matte, bounce.scattered.matte, weight - bounce.scattered.matte);
}

// Ends a path with the light that the cache knows of a surface. False: it goes on, since it updates the cache or the cache knows too little.
bool endsInCache(inout Path path, Surface surface, Bsdf bsdf, uint place, Random random) {
    CacheKey key = cacheKey(surface, cacheRandom(path, random));
    if (isUpdating(place)) {
        rememberUpdate(place, key, path, reflectanceOf(bsdf));
        return false;
    }
    vec4 cached = cachedLight(key);
    bool isKnown = cached.a > 0.0;
    path.radiance += isKnown ? path.throughput * reflectanceOf(bsdf) * cached.rgb : vec3(0.0);
    return isKnown;
}

// Leads a path to the next surface, of which the rasteriser may know the first, and on from there. False: it ends.
bool advance(inout Path path, uint place, inout Random random) {
    bool isFirst = path.bounce == 0u;
    Hit hit;
    if (isFirst && isRasterised()) {
        hit = visibleHit(place, path.direction);
    } else {
        hit = nextHit(path, random);
    }
    if (hit.instance == kNothing) {
        if (isFirst) {
            endInSky(place, path.direction);
        } else {
            path.radiance += lightBeyond(path);
        }
        return false;
    }
    Surface surface = reach(path, hit);
    bool isUnlit = (surface.flags & kUnlit) != 0u;
    Seen seen = Seen(surface.normal, hit.distance, hit.instance, surface.roughness);
    if (isFirst) {
        storePoint(place, pointBefore(hit, frame.camera.eye + hit.distance * path.direction));
        if (isUnlit) {
            endUnlit(place, seen, surface.baseColor);
            return false;
        }
    } else {
        vec3 emitted = isUnlit ? surface.baseColor : emissionShare(path, hit, surface) * surface.emission;
        path.radiance += path.throughput * emitted;
        if (isUnlit) {
            return false;
        }
    }
    Bsdf bsdf = bsdfOf(surface, -path.direction);
    if (!isFirst && usesCache() && isCached(path, surface, bsdf) && endsInCache(path, surface, bsdf, place, random)) {
        return false;
    }
    Bounce bounce = bounceAt(path, surface, bsdf, random);
    FirstLight first;
    vec3 light = path.throughput * bounce.shadow.light;
    if (isFirst) {
        first = leaveFirst(path, surface, bounce, seen, place);
    } else {
        path.throughput *= bounce.scattered.weight;
    }
    bool goesOn = follow(path, surface, bounce);
    vec3 share = transmittanceOf(bounce.shadow, path);
    if (isFirst) {
        storeFirst(place, FirstLight(first.matte * share, first.mirrored * share, first.matteWeight, first.mirroredWeight));
    } else {
        path.radiance += light * share;
    }
    return goesOn;
}

void endPath(Path path, uint place) {
    if (usesCache() && isUpdating(place)) {
        addUpdates(place, path);
    }
    FirstLight first = storedFirst(place);
    vec3 beyond = radianceOf(path);
    vec3 matteAlbedo = frame.planes.at[planePlace(kPlaneMatteAlbedo, place)].rgb;
    vec3 share = frame.planes.at[planePlace(kPlaneMirroredShare, place)].rgb;
    vec3 matte = first.matte + boundedLight(first.matteWeight * beyond);
    vec3 mirrored = first.mirrored + boundedLight(first.mirroredWeight * beyond);
    frame.planes.at[planePlace(kPlaneMatte, place)] = vec4(matte / max(matteAlbedo, 1e-3), 0.0);
    frame.planes.at[planePlace(kPlaneMirrored, place)] = vec4(mirrored / max(share, 1e-3), 0.0);
}

#include "viewer/path_launch.glsl"

#endif
