// Weights of a pixel's neighbours for both filters, and the spiral of samples.
#ifndef REFLECTIONS_NEIGHBOUR
#define REFLECTIONS_NEIGHBOUR

#include "reflections/gbuffer.glsl"
#include "reflections/noise.glsl"

struct Centre {
    vec3 position;
    vec3 normal;
    float roughness;
    float distance;
};

bool readCentre(ivec2 pixel, out Centre centre) {
    vec3 direction = cameraDirection(frame.camera, uvec2(pixel));
    float depth = textureBindlessFetch2D(frame.opaqueDepth, pixel, 0).r;
    if (depth <= 0.0) {
        return false;
    }
    uvec4 texel = textureBindlessFetchU2D(frame.opaqueSurface, pixel, 0);
    centre.distance = depthDistance(depth, direction);
    centre.position = frame.camera.eye + direction * centre.distance;
    centre.normal = packedNormal(texel);
    centre.roughness = packedRoughness(texel);
    return true;
}

// 1 for neighbours on the same smooth surface, down to 0 across edges; the sharper, the less it may be curved.
float onOneSurface(Centre a, Centre b, float sharpness) {
    float offPlane = abs(dot(a.normal, b.position - a.position)) / (0.01 * a.distance);
    return pow(max(dot(a.normal, b.normal), 0.0), sharpness) * exp(-offPlane * offPlane);
}

// Neighbours are taken along a spiral that every pixel turns differently; `purpose` tells filters apart.
float spiralTurn(ivec2 pixel, uint purpose) {
    return 6.2831853 * spreadNoise(uvec2(pixel), purpose).x;
}

// Distance of tap `i` of `count` from the centre, 0 to 1.
float spiralSpoke(int i, int count) {
    return sqrt((float(i) + 0.5) / float(count));
}

ivec2 spiralStep(int i, float turn, float radius) {
    float angle = turn + float(i) * 2.39996323; // the golden angle
    return ivec2(round(radius * vec2(cos(angle), sin(angle))));
}

bool isInPicture(ivec2 pixel) {
    return all(greaterThanEqual(pixel, ivec2(0))) && all(lessThan(pixel, ivec2(frame.camera.width, frame.camera.height)));
}

#endif
