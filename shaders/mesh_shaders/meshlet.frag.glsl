// A colour for each meshlet.
#extension GL_EXT_mesh_shader : require
#include "mesh_shaders/frame.glsl"
#include "mesh_shaders/shade.glsl"
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) perprimitiveEXT in flat uint meshletNumber;
layout(location = 0) out vec4 result;

void main() {
    vec3 toEye = normalize(frame.camera.eye - position);
    result = vec4(lit(meshletColor(meshletNumber, frame.count), normalize(normal), toEye), 1.0);
}
