// Surfaces as the camera sees them.
#include "omni_shadows/frame.glsl"

layout(location = 0) out vec3 position;
layout(location = 1) out vec3 normal;
layout(location = 2) flat out uint number;

void main() {
    Vertex corner = frame.vertices.at[frame.corners.at[gl_VertexIndex]];
    Instance thing = frame.instances.at[gl_InstanceIndex];
    position = toWorld(thing, corner.position);
    normal = toWorld(thing, corner.normal) - toWorld(thing, vec3(0.0));
    number = gl_InstanceIndex;
    gl_Position = cameraClip(frame.camera, position);
}
