// Corners of a body's triangles, by number.
#include "rtx_ao/frame.glsl"

layout(location = 0) out vec3 outPosition;
layout(location = 1) out vec3 outNormal;
layout(location = 2) out vec2 outTexcoord;
layout(location = 3) flat out vec3 outGeometric;
layout(location = 4) flat out uint outTriangle;
layout(location = 5) out vec3 outColor;

invariant gl_Position; // the pass that colours draws where the one before left its depth

vec3 toWorld(vec4 v) {
    return vec3(dot(frame.bodies.at[body].rows[0], v), dot(frame.bodies.at[body].rows[1], v),
                dot(frame.bodies.at[body].rows[2], v));
}

vec3 cornerPosition(uint corner) {
    return toWorld(vec4(Vec3Array(frame.bodies.at[body].positions).at[corner], 1.0));
}

void main() {
    outTriangle = uint(gl_VertexIndex) / 3u;
    uvec3 corners = TriangleArray(frame.bodies.at[body].triangles).at[outTriangle];
    uint corner = corners[uint(gl_VertexIndex) % 3u];
    outPosition = cornerPosition(corner);
    outNormal = toWorld(vec4(Vec3Array(frame.bodies.at[body].normals).at[corner], 0.0));
    outTexcoord = Vec2Array(frame.bodies.at[body].texcoords).at[corner];
    uvec2 colors = frame.bodies.at[body].colors;
    outColor = colors == uvec2(0u) ? vec3(1.0) : Vec3Array(colors).at[corner];
    vec3 first = cornerPosition(corners.x);
    outGeometric = normalize(cross(cornerPosition(corners.y) - first, cornerPosition(corners.z) - first));
    gl_Position = cameraClip(frame.camera, outPosition);
}
