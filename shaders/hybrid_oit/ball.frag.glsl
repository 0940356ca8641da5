// A ball into the G-buffer.
#include "hybrid_oit/ball.glsl"
#include "hybrid_oit/gbuffer.glsl"

layout(location = 0) flat in uint inSphere;
layout(location = 0) out vec4 outPosition; // w: distance from the eye
layout(location = 1) out uvec4 outSurface;

const uint kSlackSteps = 16u;

void main() {
    Sphere sphere = frame.spheres.at[inSphere];
    vec3 direction = pixelRay();
    Crossing crossing = ballCrossing(sphere, direction);
    vec3 position = frame.camera.eye + crossing.entry * direction;
    outPosition = vec4(position, crossing.entry);
    outSurface = packSurface(normalize(position - sphere.center), sphere.color, 1.0);
    gl_FragDepth = ballDepth(crossing, kSlackSteps);
}
