// A square in front of the camera for each light: the orb itself, or with GLOW the shine around it.
#include "deferred/frame.glsl"

layout(location = 0) out vec2 place;
layout(location = 1) flat out vec3 color;

#ifdef GLOW
const float kSize = 0.42;
#else
const float kSize = kOrbRadius;
#endif

void main() {
    PointLight light = lightAt(gl_InstanceIndex);
    place = 2.0 * vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1) - 1.0;
    color = light.color;
    vec3 corner = light.position + kSize * (place.x * cameraRight() + place.y * cameraDown());
    gl_Position = cameraClip(frame.camera, corner);
}
