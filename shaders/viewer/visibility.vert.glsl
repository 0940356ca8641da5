// Rasterises a geometry of the instances that are drawn, by the same numbers that rays meet. Each corner of a triangle is a vertex of
// its own, so that the number of the triangle needs no feature of the device.
#include "viewer/hit.glsl"

layout(location = 0) flat out uvec2 outTriangle;
layout(location = 1) out vec2 outBarycentrics;

void main() {
    uint number = firstVisible == kAllInstances ? gl_InstanceIndex : frame.visible.at[firstVisible + gl_InstanceIndex];
    Instance instance = frame.instances.at[number];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + argument];
    uint primitive = uint(gl_VertexIndex) / 3u;
    uint corner = uint(gl_VertexIndex) % 3u;
    uint vertex = CornerArray(geometry.indices).at[primitive][corner];
    outTriangle = uvec2(number, primitive);
    outBarycentrics = vec2(corner == 1u, corner == 2u);
    gl_Position = cameraClip(frame.camera, toWorld(instance, positionOf(geometry, vertex)));
}
