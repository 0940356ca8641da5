// A body around all that a light reaches, of which only the far side is drawn.
#include "deferred/frame.glsl"

layout(location = 0) flat out vec4 place; // position and reach
layout(location = 1) flat out vec3 color;

// An icosahedron: twelve corners, twenty triangles seen counter-clockwise from outside.
const float kLong = 0.8506508;
const float kShort = 0.5257311;
const vec3 kCorners[12] = vec3[](
    vec3(-kShort, kLong, 0), vec3(kShort, kLong, 0), vec3(-kShort, -kLong, 0), vec3(kShort, -kLong, 0),
    vec3(0, -kShort, kLong), vec3(0, kShort, kLong), vec3(0, -kShort, -kLong), vec3(0, kShort, -kLong),
    vec3(kLong, 0, -kShort), vec3(kLong, 0, kShort), vec3(-kLong, 0, -kShort), vec3(-kLong, 0, kShort));
const uint kTriangles[60] = uint[](
    0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4, 11, 10, 2, 10, 7, 6, 7, 1, 8,
    3, 9, 4, 3, 4, 2, 3, 2, 6, 3, 6, 8, 3, 8, 9, 4, 9, 5, 2, 4, 11, 6, 2, 10, 8, 6, 7, 9, 8, 1);
// Over the radius of the sphere inside: its faces touch what the light reaches.
const float kAround = 1.0 / 0.7946544;

void main() {
    PointLight light = lightAt(gl_InstanceIndex);
    place = vec4(light.position, light.reach);
    color = light.color;
    gl_Position = cameraClip(frame.camera, light.position + kAround * light.reach * kCorners[kTriangles[gl_VertexIndex]]);
}
