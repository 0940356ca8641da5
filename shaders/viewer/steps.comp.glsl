// Steps that the ray of each pixel takes through the acceleration structures, as colours. Only the library's own traversal counts them.
#include "common/group_pixel.glsl"

#define LVK_COUNT_TRAVERSAL_STEPS
#include "viewer/trace_query.glsl"
#include "viewer/nearest_ray.glsl"
#include "viewer/plane.glsl"

// Steps that are white.
const float kMostSteps = 512.0;

// From black over blue, green and red to white.
vec3 heat(float share) {
    const vec3 kColors[6] = vec3[](vec3(0.0), vec3(0.05, 0.1, 0.7), vec3(0.0, 0.6, 0.6), vec3(0.4, 0.8, 0.1),
                                   vec3(0.95, 0.25, 0.05), vec3(1.0));
    float place = clamp(share, 0.0, 1.0) * 5.0;
    uint low = min(uint(place), 4u);
    return mix(kColors[low], kColors[low + 1u], place - float(low));
}

void stepsPixel(uvec2 pixel) {
    lvkTraversalSteps = 0u;
    uint rayCount = 0u;
    nearestHit(frame.camera.eye, cameraDirection(frame.camera, pixel), 1e30, 0u, true, rayCount);
    // Few steps and many differ by orders of magnitude.
    float share = log2(1.0 + float(lvkTraversalSteps)) / log2(1.0 + kMostSteps);
    frame.planes.at[planePlace(kPlaneShown, pixelPlace(ivec2(pixel)))] = vec4(heat(share), 1.0);
}

#define PIXEL_FUNCTION stepsPixel
#include "common/for_each_pixel.glsl"
