// A sample of a pixel: a path from the camera.
#ifndef VIEWER_SAMPLE_PATH
#define VIEWER_SAMPLE_PATH

#include "viewer/path.glsl"

// Samples of a pixel are spread over all of it.
Path beginPath(uvec2 pixel, inout Random random) {
    vec2 ndc = (vec2(pixel) + nextPair(random)) / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
    return cameraPath(normalize(frame.camera.forward + ndc.x * frame.camera.right + ndc.y * frame.camera.down));
}

// Leads a path from its origin to the next surface, and on from there. False: it ends.
bool advance(inout Path path, uint place, inout Random random) {
    Hit hit = nextHit(path, kFar, random);
    if (hit.instance == kNothing) {
        path.radiance += lightBeyond(path);
        return false;
    }
    Surface surface = reach(path, hit);
    if ((surface.flags & kUnlit) != 0u) {
        path.radiance += path.throughput * surface.baseColor;
        return false;
    }
    path.radiance += path.throughput * emissionShare(path, hit, surface) * surface.emission;
    Bounce bounce = bounceAt(path, surface, bsdfOf(surface, -path.direction), random);
    vec3 light = path.throughput * bounce.shadow.light;
    path.throughput *= bounce.scattered.weight;
    bool goesOn = follow(path, surface, bounce);
    path.radiance += light * transmittanceOf(bounce.shadow, path);
    return goesOn;
}

void endPath(Path path, uint place) {
    bool isFirst = frame.sampleNumber + (argument >> 16) == 0u;
    vec4 before = isFirst ? vec4(0.0) : frame.sums.at[place];
    frame.sums.at[place] = before + vec4(radianceOf(path), float(path.rayCount));
}

#include "viewer/path_launch.glsl"

#endif
