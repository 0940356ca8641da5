// Corners of the models: without texture coordinates.
#include "triplanar/frame.glsl"
layout(location = 0) out vec3 position; // of the model, as large as it is shown
layout(location = 1) out vec3 normal;
layout(location = 2) out vec3 place;
layout(location = 3) flat out uint number;

void main() {
    Vertex corner = frame.vertices.at[gl_VertexIndex];
    Body body = frame.bodies.at[gl_InstanceIndex];
    position = body.size * corner.position;
    normal = corner.normal;
    place = body.place + turned(body, position);
    number = gl_InstanceIndex;
    gl_Position = cameraClip(frame.camera, place);
}
