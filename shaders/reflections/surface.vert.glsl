// Rasterises a geometry of the table, in all its instances, by the same numbers that rays meet.
#include "reflections/surface.glsl"

layout(location = 0) out vec3 outPosition;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outTexcoord;
layout(location = 3) flat out uint outQuad;
// The blended pass compares depths with those of the pass before.
invariant gl_Position;

void main() {
    Instance instance = frame.instances.at[gl_InstanceIndex];
    Geometry geometry = frame.geometries.at[passArguments[0]];
    uint vertex = uint(gl_VertexIndex);
    outPosition = vertexPosition(geometry, instance, vertex);
    outNormal = vertexNormal(geometry, instance, vertex);
    outTexcoord = vertexTexcoord(geometry, vertex);
    outQuad = vertex >> 2u;
    gl_Position = cameraClip(frame.camera, outPosition);
}
