// Depth of a ball.
#include "hybrid_oit/ball.glsl"

layout(location = 0) flat in uint inSphere;

void main() {
    Sphere sphere = frame.spheres.at[inSphere];
    Crossing crossing = ballCrossing(sphere, pixelRay());
    gl_FragDepth = ballDepth(crossing, 0u);
}
