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

#ifdef HYBRID_GBUFFER
// The surface that the geometry pass left in the G-buffer.
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
