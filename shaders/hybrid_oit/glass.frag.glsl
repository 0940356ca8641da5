// A sphere of glass into the lists: a node where the pixel's ray enters it and one where it leaves it, as far as the
// opaque surface does not hide them. No colour target is drawn to.
#include "hybrid_oit/glass.glsl"
#include "hybrid_oit/list.glsl"

layout(early_fragment_tests) in;
layout(location = 0) flat in uint inSphere;

void main() {
    uvec2 pixel = uvec2(gl_FragCoord.xy);
    Sphere sphere = frame.spheres.at[inSphere];
    vec3 direction = cameraDirection(frame.camera, pixel);
    Crossing crossing;
    if (!crossSphere(sphere.center, sphere.radius, frame.camera.eye, direction, crossing)) {
        return;
    }
    float opaque = textureBindlessFetch2D(frame.gbufferPosition, ivec2(pixel), 0).w;
    float end = opaque > 0.0 ? min(crossing.exit, opaque) : crossing.exit;
    if (crossing.entry >= end) {
        return;
    }
    vec3 light = frame.glassLight.at[inSphere - frame.ballCount];
    Layer front = frontLayer(sphere, direction, crossing, end - crossing.entry, light);
    addNode(pixel, crossing.entry, front.radiance, front.transmittance);
    if (end == crossing.exit) {
        Layer back = backLayer(sphere, direction, crossing, light);
        addNode(pixel, crossing.exit, back.radiance, back.transmittance);
    }
}
