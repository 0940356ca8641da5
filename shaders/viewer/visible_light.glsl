// The light of what pixels show whose turn it is, of one sample: a shadow ray, and a path in a direction that the surface prefers, which may
// end with the light of the radiance cache. Matte layers and all others are kept apart, without their colours, for the filter.
#ifndef VIEWER_VISIBLE_LIGHT
#define VIEWER_VISIBLE_LIGHT

#include "viewer/history.glsl"
#include "viewer/light_turn.glsl"
#include "viewer/radiance_cache.glsl"
#include "viewer/visible_surface.glsl"

// Exposed light that a path brings in the first frame of a still at most. A brighter path would leave a bright spot for many frames.
const float kBrightestPath = 12.0;

// Light that a path brings to the eye. The bound grows with the samples of a still, by the fourth root of their number: a spot fades
// before it is seen, and the mean still comes to that of all paths.
vec3 boundedLight(vec3 light) {
    float bound = kBrightestPath * sqrt(sqrt(1.0 + float(frame.stillCount / frame.lightTurns)));
    float most = largest(light) * frame.exposure;
    return most > bound ? light * (bound / most) : light;
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
    storeSky(place, direction);
    storeFirst(place, kNoLight);
}

// A pixel that shows an unlit surface.
void endUnlit(uint place, Seen seen, vec3 color) {
    storeSurface(place, seen, color, vec3(0.0), vec3(0.0));
    storeFirst(place, kNoLight);
}

// True if a pixel finds light in this frame: if it is its turn, if nothing is known of its surface, or if its path updates the cache.
bool findsLight(uint place, Seen seen, vec3 pointBefore) {
    uvec2 pixel = pixelOf(place);
    if (isTurn(pixel) || frame.frameNumber == 0u || (usesCache() && isUpdating(place))) {
        return true;
    }
    // As the pass over time reads it.
    seen = unpackedSeen(packedSeen(seen));
    vec3 point = seenPoint(frame.camera, ivec2(pixel), seen.distance);
    return !hasHistory(vec2(pixel) + 0.5 - motionOf(point, pointBefore), seen, pointBefore);
}

// A pixel that finds no light in this frame.
void endWithoutLight(uint place, Seen seen, Surface surface, Bsdf bsdf) {
    storeLayers(place, seen, surface, bsdf);
    frame.planes.at[planePlace(kPlaneMatte, place)] = vec4(0.0, 0.0, 0.0, kNoSample);
}

FirstLight leaveFirst(inout Path path, Surface surface, Bounce bounce, Seen seen, uint place) {
    vec3 weight = bounce.scattered.weight;
    storeLayers(place, seen, surface, bounce.bsdf);
    path.throughput = vec3(any(greaterThan(weight, vec3(0.0))));
    ShadowRay shadow = bounce.shadow;
    return FirstLight(shadow.matte, shadow.light - shadow.matte, bounce.scattered.matte, weight - bounce.scattered.matte);
}

#ifdef AMBIENT_OCCLUSION
#include "viewer/ambient_term.glsl"

// Surfaces that a pixel shows, in mirrors and through glass too.
const uint kMostSurfaces = 4u;
// Bit of Path.bounce of a path whose next ray is its last one.
const uint kEndsInAmbient = 0x80000000u;

bool endsInAmbient(Path path) {
    return (path.bounce & kEndsInAmbient) != 0u;
}

// Ends a path with ambient light behind its next ray, if its direction stands for many.
void chooseEnd(inout Path path, Scattered scattered) {
    bool isWide = !scattered.isPane && scattered.density < LEAST_DENSITY;
    path.bounce |= isWide || path.bounce >= kMostSurfaces ? kEndsInAmbient : 0u;
}

// How far the next ray of a path looks. Without a sky nothing is to be found beyond what takes ambient light.
float rangeOf(Path path) {
    return endsInAmbient(path) && frame.skyProbability <= 0.0 ? frame.occlusionDistance : kFar;
}

// True if a path that would end has met a material that lets light through. It does not end then.
bool goesThrough(inout Path path, Hit hit) {
    if (hit.instance == kNothing || (path.bounce & ~kEndsInAmbient) >= kMostSurfaces) {
        return false;
    }
    uint material = frame.geometries.at[frame.instances.at[hit.instance].firstGeometry + hit.geometry].material;
    bool isTransparent = frame.materials.at[material].transmission > 0.0;
    if (isTransparent) {
        path.bounce &= ~kEndsInAmbient;
    }
    return isTransparent;
}

// Light of the sky, or from about the surface that hides it, the less the nearer that is. A ray that has not looked further, for want of
// a sky, has found neither: it brings light for the share of rays that would meet a surface.
vec3 ambientLight(Path path, Hit hit) {
    if (hit.instance != kNothing) {
        return ambientRadiance() * min(hit.distance / frame.occlusionDistance, 1.0);
    }
    return frame.skyProbability > 0.0 ? missedLight(path.direction, path.density) : (1.0 - skyVisibility()) * ambientRadiance();
}
#else
bool endsInAmbient(Path path) {
    return false;
}

bool goesThrough(inout Path path, Hit hit) {
    return false;
}

void chooseEnd(inout Path path, Scattered scattered) {
}

float rangeOf(Path path) {
    return kFar;
}

vec3 ambientLight(Path path, Hit hit) {
    return vec3(0.0);
}
#endif

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
        hit = nextHit(path, rangeOf(path), random);
    }
    if (endsInAmbient(path) && !goesThrough(path, hit)) {
        path.radiance += path.throughput * ambientLight(path, hit);
        return false;
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
    bool isWithoutLight = false;
    Seen seen = Seen(surface.normal, hit.distance, hit.instance, surface.roughness);
    if (isFirst) {
        vec4 before = pointBefore(hit, frame.camera.eye + hit.distance * path.direction);
        storePoint(place, before);
        if (isUnlit) {
            endUnlit(place, seen, surface.baseColor);
            return false;
        }
        isWithoutLight = !findsLight(place, seen, before.xyz);
    } else {
        vec3 emitted = isUnlit ? surface.baseColor : emissionShare(path, hit, surface) * surface.emission;
        path.radiance += path.throughput * emitted;
        if (isUnlit) {
            return false;
        }
    }
    Bsdf bsdf = bsdfOf(surface, -path.direction);
    if (isWithoutLight) {
        endWithoutLight(place, seen, surface, bsdf);
        return false;
    }
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
    chooseEnd(path, bounce.scattered);
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
    if (!isSample(frame.planes.at[planePlace(kPlaneMatte, place)])) {
        return;
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
