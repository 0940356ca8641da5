// The triangle that a pixel shows.
#define VIEWER_RASTERISES
#include "viewer/candidate.glsl"
#include "viewer/light_turn.glsl"

layout(location = 0) flat in uvec2 inTriangle;
layout(location = 1) in vec2 inBarycentrics;
layout(location = 0) out uvec4 outTriangle;

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    Instance instance = frame.instances.at[inTriangle.x];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + argument];
    if ((geometry.flags & kSingleSided) != 0u && gl_FrontFacing == flipsWinding(instance)) {
        discard;
    }
    if ((frame.materials.at[geometry.material].flags & (kAlphaMask | kAlphaBlend)) != 0u) {
        Payload payload;
        payload.seed = nearestSeed(hashWords(randomOf(pixel, 0u).seed, firstSample(pixel)));
        Hit hit = Hit(inTriangle.x, argument, inTriangle.y, inBarycentrics, 0.0);
        if (passesThrough(hit, cameraDirection(frame.camera, pixel), payload)) {
            discard;
        }
    }
    outTriangle = uvec4(inTriangle.x, argument, inTriangle.y, 0u);
}
