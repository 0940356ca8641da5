// From a pixel to its colour in the output image, for both methods.
#ifndef HYBRID_PIXEL
#define HYBRID_PIXEL

#include "common/octahedral.glsl"
#include "common/tonemap.glsl"
#include "hybrid/integrator.glsl"

Ray primaryRay(uvec2 pixel) {
    vec3 direction = cameraDirection(frame.camera, pixel);
    float tmin = cameraNearDistance(frame.camera, direction);
    return Ray(frame.camera.eye, tmin, direction, 0.0, vec3(1.0), 0u);
}

#if defined(HYBRID_GBUFFER)
// The surface that the paper's geometry pass left in the G-buffer.
bool primarySurface(uvec2 pixel, Ray ray, out SurfacePoint point) {
    ivec2 texel = ivec2(pixel);
    uvec4 surface = textureBindlessFetchU2D(frame.gbufferSurface, texel, 0);
    point.triangle = surface.w;
    if (point.triangle == kNoTriangle) {
        return false;
    }
    vec4 position = textureBindlessFetch2D(frame.gbufferPosition, texel, 0);
    point.position = position.xyz;
    point.distance = position.w;
    point.normal = unitFromOctahedral(uintBitsToFloat(surface.xy));
    point.geometricNormal = unitFromOctahedral(unpackSnorm2x16(surface.z));
    point.albedo = textureBindlessFetch2D(frame.gbufferAlbedo, texel, 0).rgb;
    return true;
}
#elif defined(HYBRID_VISIBILITY)
// The triangle that the visibility pass found; kNoTriangle also where the ray must say, and then `isInDoubt`.
uint visibleTriangle(uvec2 pixel, out bool isInDoubt) {
    Visibility visibility = frame.visibility;
    isInDoubt = false;
    if (visibility.image != kNoImage) {
        return textureBindlessFetchU2D(visibility.image, ivec2(pixel), 0).x;
    }
    uvec2 word = visibility.words.at[pixel.y * frame.camera.width + pixel.x];
    isInDoubt = word.x == kAskRay;
    return word.y == kNoTriangle || isInDoubt ? kNoTriangle : ~word.x;
}

// The surface of the triangle that the visibility pass found, where the pixel's ray meets it.
bool primarySurface(uvec2 pixel, Ray ray, out SurfacePoint point) {
    bool isInDoubt;
    uint triangle = visibleTriangle(pixel, isInDoubt);
    Hit hit = Hit(triangle, vec2(0.0));
    if (isInDoubt) {
        hit = traceClosest(ray.origin, ray.tmin, ray.direction, kFar);
    } else if (triangle != kNoTriangle) {
        hit.barycentrics = barycentricsAlong(frame.scene, triangle, ray.origin, ray.direction);
    }
    if (hit.triangle == kNoTriangle) {
        return false;
    }
    point = surfaceAt(frame.scene, hit.triangle, hit.barycentrics, ray.origin, ray.direction, 0.0,
                      frame.camera.pixelSpread, frame.surfaceSampler);
    return true;
}
#else
bool primarySurface(uvec2 pixel, Ray ray, out SurfacePoint point) {
    return surfaceAlong(ray, point);
}
#endif

void renderPixel(uvec2 pixel) {
    Ray ray = primaryRay(pixel);
    SurfacePoint point;
    bool found = primarySurface(pixel, ray, point);
    vec3 color = lightAlong(ray, point, found);
    imageStore(kImages2D[frame.outputImage], ivec2(pixel), vec4(encodeSrgb(expose(color)), 1.0));
}

#endif
