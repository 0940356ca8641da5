// Shadow casters, as the lamp sees them through a face of the cube around it.
#ifdef OMNI_MULTIVIEW
#extension GL_EXT_multiview : require
#endif
#include "omni_shadows/frame.glsl"

// Intersection of a direction with a face, times the distance along the face's axis, which is the third: the faces as Vulkan turns
// them ("Cube Map Face Selection and Transformations").
vec3 onFace(uint side, vec3 d) {
    switch (side) {
    case 0u: return vec3(-d.z, -d.y, d.x);
    case 1u: return vec3(d.z, -d.y, -d.x);
    case 2u: return vec3(d.x, d.z, d.y);
    case 3u: return vec3(d.x, -d.z, -d.y);
    case 4u: return vec3(d.x, -d.y, d.z);
    default: return vec3(-d.x, -d.y, -d.z);
    }
}

void main() {
#ifdef OMNI_MULTIVIEW
    uint side = uint(gl_ViewIndex);
#else
    uint side = face;
#endif
    Vertex corner = frame.vertices.at[frame.corners.at[gl_VertexIndex]];
    vec3 place = onFace(side, toWorld(frame.instances.at[gl_InstanceIndex], corner.position) - frame.light);
    gl_Position = vec4(place.xy, frame.lampNear, place.z);
}
