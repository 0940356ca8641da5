// From a pixel to its colour in the output image, for both methods.
#ifndef HYBRID_PIXEL
#define HYBRID_PIXEL

#include "common/octahedral.glsl"
#include "common/tonemap.glsl"
#include "hybrid/integrator.glsl"
#include "hybrid/visible_triangle.glsl"

#if defined(HYBRID_ORDERED)
// Threads that a device runs in step, and how many such groups of threads the pixels that go on are spread over: as many
// as run at once. In fewer, one pixel's rays would wait for those of many; in more, some would begin late.
const uint kNeighbours = 32u;
const uint kFirstGroups = 2048u;

// The pixel at a place of the order: some that go on beside some others, as long as there are such.
uvec2 pixelInOrder(uint index) {
    uint firsts = frame.order.firsts;
    uint groups = frame.camera.width * frame.camera.height / kNeighbours;
    uint share = min(firsts / max(min(kFirstGroups, groups), 1u) + 1u, kNeighbours);
    uint lane = index % kNeighbours;
    uint before = index / kNeighbours * share + min(lane, share);
    bool isFirst = lane < share && before < firsts;
    uint place = frame.order.at[isFirst ? before : firsts + index - min(before, firsts)];
    return uvec2(place & 0xffffu, place >> 16);
}
#endif

#if defined(HYBRID_QUEUE)
// A place in the queue for each thread that asks.
uint takeBouncePlace() {
#if defined(HYBRID_NO_SUBGROUPS)
    uint place = atomicAdd(frame.bounces.head.rays.x, 1u);
    atomicMax(frame.bounces.head.groups.x, place / kBounceGroup + 1u);
    return place;
#else
    // Once for all that ask together; neighbours get neighbouring places.
    uvec4 askers = subgroupBallot(true);
    uint first = 0u;
    if (subgroupElect()) {
        uint count = subgroupBallotBitCount(askers);
        first = atomicAdd(frame.bounces.head.rays.x, count);
        atomicMax(frame.bounces.head.groups.x, (first + count + kBounceGroup - 1u) / kBounceGroup);
    }
    return subgroupBroadcastFirst(first) + subgroupBallotExclusiveBitCount(askers);
#endif
}
#endif

Ray primaryRay(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    float tmin = cameraNearDistance(frame.camera, direction);
    return Ray(frame.camera.eye, tmin, direction, 0.0, vec3(1.0), 0u);
}

#if defined(HYBRID_GBUFFER)
// The triangle that the paper's geometry pass left in the G-buffer.
Hit primaryHit(uvec2 pixel, Ray ray, out bool isKnown) {
    isKnown = true;
    return Hit(textureBindlessFetchU2D(frame.gbufferSurface, ivec2(pixel), 0).w, vec2(0.0));
}

// Its surface, from there too.
SurfacePoint primarySurface(uvec2 pixel, Ray ray, Hit hit) {
    ivec2 texel = ivec2(pixel);
    uvec4 surface = textureBindlessFetchU2D(frame.gbufferSurface, texel, 0);
    vec4 position = textureBindlessFetch2D(frame.gbufferPosition, texel, 0);
    SurfacePoint point;
    point.triangle = hit.triangle;
    point.position = position.xyz;
    point.distance = position.w;
    point.normal = unitFromOctahedral(uintBitsToFloat(surface.xy));
    point.geometricNormal = unitFromOctahedral(unpackSnorm2x16(surface.z));
    point.albedo = textureBindlessFetch2D(frame.gbufferAlbedo, texel, 0).rgb;
    return point;
}
#else
#if defined(HYBRID_VISIBILITY)
#include "hybrid/hardware_visibility.glsl"

// Intersection of the pixel's ray with the triangle that the visibility pass found; unknown where that is in doubt.
Hit primaryHit(uvec2 pixel, Ray ray, out bool isKnown) {
    bool isInDoubt;
    bool byHardware = frame.visibility.image != kNoImage;
    uint triangle = byHardware ? hardwareTriangle(ivec2(pixel), ray.direction, isInDoubt)
                               : visibleTriangle(pixel, isInDoubt);
    isKnown = !isInDoubt;
    Hit hit = Hit(triangle, vec2(0.0));
    if (isKnown && hit.triangle != kNoTriangle) {
        hit.barycentrics = barycentricsAlong(hit.triangle, ray.origin, ray.direction);
    }
    return hit;
}
#else
// Unknown until the pixel's ray is traced.
Hit primaryHit(uvec2 pixel, Ray ray, out bool isKnown) {
    isKnown = false;
    return Hit(kNoTriangle, vec2(0.0));
}
#endif

SurfacePoint primarySurface(uvec2 pixel, Ray ray, Hit hit) {
    return surfaceOf(hit, ray);
}
#endif

// Adds the sample's colour to the pixel; the last sample gives the picture. Colours are averaged as they are shown, so
// that a light beside a dark wall has a smooth edge too.
void finishPixel(uvec2 pixel, vec3 color) {
    vec3 shown = expose(color);
    if (frame.sampleCount > 1u) {
        uint index = pixel.y * frame.camera.width + pixel.x;
        shown += frame.sampleNumber > 0u ? frame.sums.at[index] : vec3(0.0);
        frame.sums.at[index] = shown;
        shown /= float(frame.sampleCount);
    }
    if (frame.sampleNumber + 1u == frame.sampleCount) {
        // All have the same index, but SwiftShader asks the first lane for it, even one that took another way.
        imageStore(kImages2D[nonuniformEXT(frame.outputImage)], ivec2(pixel), vec4(encodeSrgb(shown), 1.0));
    }
}

#if defined(HYBRID_BOUNCES)
// Follows the rays of a queued pixel.
void renderBounces(uint index) {
    if (index >= frame.bounces.head.rays.x) {
        return;
    }
    BouncePixel queued = frame.bounces.pixels.at[index];
    uvec2 pixel = uvec2(queued.place & 0xffffu, queued.place >> 16);
    Ray ray = primaryRay(pixel);
    SurfacePoint point = primarySurface(pixel, ray, Hit(queued.triangle, queued.barycentrics));
    vec3 color = queued.color;
    addLightBeyond(ray, point, color);
    finishPixel(pixel, color);
}
#elif defined(HYBRID_QUEUE)
// Renders the pixel, or its first surface alone where there is more: the rest is queued.
void renderPixel(uvec2 pixel) {
    Ray ray = primaryRay(pixel);
    bool isKnown;
    Hit hit = primaryHit(pixel, ray, isKnown);
    if (!isKnown) {
        hit = traceClosest(ray.origin, ray.tmin, ray.direction, kFar);
    }
    if (hit.triangle == kNoTriangle) {
        finishPixel(pixel, skyColor(ray.direction));
        return;
    }
    Encounter met = encounterAt(ray, primarySurface(pixel, ray, hit));
    vec3 color = localLight(ray, met);
    if (goesOn(met.branches)) {
        uint place = takeBouncePlace();
        frame.bounces.pixels.at[place] = BouncePixel(pixel.x | pixel.y << 16, hit.triangle, hit.barycentrics, color);
        return;
    }
    finishPixel(pixel, color);
}
#else
void renderPixel(uvec2 pixel) {
    Ray ray = primaryRay(pixel);
    bool isKnown;
    Hit hit = primaryHit(pixel, ray, isKnown);
    if (isKnown && hit.triangle == kNoTriangle) {
        finishPixel(pixel, skyColor(ray.direction));
        return;
    }
    SurfacePoint point;
    if (isKnown) {
        point = primarySurface(pixel, ray, hit);
    }
    vec3 color = vec3(0.0);
    waitingCount = 0u;
    addLightAlong(ray, isKnown, point, color);
    finishPixel(pixel, color);
}
#endif

#endif
