// Moves the vertices of a geometry by morph targets and then by joints, into the buffers that draws, rays and the refit read.

layout(local_size_x = 64) in;

#include "common/octahedral.glsl"

struct RestVertex {
    vec3 position;
    vec3 normal;
    vec4 tangent; // and the side of the bitangent; 0 without a tangent
};

struct Influence {
    uvec2 joints; // four numbers of 16 bits
    vec4 weights;
};

// What a morph target of weight 1 adds.
struct Delta {
    vec3 position;
    vec3 normal;
    vec3 tangent;
};

struct Joint {
    vec4 rows[3]; // from the mesh at rest to the scene
};

struct TargetWeight {
    uint target;
    float weight;
};

// As in frame.glsl.
struct Attributes {
    uint normal;
    uint tangent;
    vec2 texcoords[2];
    uint color;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer RestArray { RestVertex at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer InfluenceArray { Influence at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DeltaArray { Delta at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer JointArray { Joint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer WeightArray { TargetWeight at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PositionArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer AttributesArray { Attributes at[]; };

layout(push_constant, scalar) uniform Push {
    RestArray rest;
    InfluenceArray influences; // a set of four for each vertex, then the next set
    DeltaArray deltas; // of each vertex, then of the next target
    JointArray joints;
    WeightArray weights; // of the targets whose weight is not 0
    PositionArray positions;
    PositionArray before; // of the frame before
    AttributesArray attributes;
    uint vertexCount;
    uint setCount;
    uint weightCount;
    uint isFirst; // not 0: there is no frame before
};

void addTargets(inout RestVertex v, uint vertex) {
    for (uint i = 0u; i < weightCount; ++i) {
        Delta delta = deltas.at[weights.at[i].target * vertexCount + vertex];
        float weight = weights.at[i].weight;
        v.position += weight * delta.position;
        v.normal += weight * delta.normal;
        v.tangent.xyz += weight * delta.tangent;
    }
}

Joint jointOf(uint vertex) {
    Joint sum = Joint(vec4[](vec4(0.0), vec4(0.0), vec4(0.0)));
    for (uint set = 0u; set < setCount; ++set) {
        Influence influence = influences.at[set * vertexCount + vertex];
        for (uint i = 0u; i < 4u; ++i) {
            uint joint = influence.joints[i >> 1] >> (16u * (i & 1u)) & 0xffffu;
            for (uint row = 0u; row < 3u; ++row) {
                sum.rows[row] += influence.weights[i] * joints.at[joint].rows[row];
            }
        }
    }
    return sum;
}

void applyJoint(inout RestVertex v, Joint joint) {
    vec4 p = vec4(v.position, 1.0);
    v.position = vec3(dot(joint.rows[0], p), dot(joint.rows[1], p), dot(joint.rows[2], p));
    vec3 x = joint.rows[0].xyz;
    vec3 y = joint.rows[1].xyz;
    vec3 z = joint.rows[2].xyz;
    v.tangent.xyz = vec3(dot(x, v.tangent.xyz), dot(y, v.tangent.xyz), dot(z, v.tangent.xyz));
    // Normals turn by the inverse transpose, which is as long as the determinant allows: its cofactors are not divided by it.
    vec3 cofactors[3] = vec3[](cross(y, z), cross(z, x), cross(x, y));
    float side = dot(x, cofactors[0]) < 0.0 ? -1.0 : 1.0;
    v.normal = side * vec3(dot(cofactors[0], v.normal), dot(cofactors[1], v.normal), dot(cofactors[2], v.normal));
}

vec3 unitOr(vec3 v, vec3 other) {
    float longest = max(abs(v.x), max(abs(v.y), abs(v.z)));
    return longest > 0.0 ? normalize(v / longest) : other;
}

void main() {
    uint vertex = gl_GlobalInvocationID.x;
    if (vertex >= vertexCount) {
        return;
    }
    RestVertex v = rest.at[vertex];
    addTargets(v, vertex);
    if (setCount > 0u) {
        applyJoint(v, jointOf(vertex));
    }
    before.at[vertex] = isFirst != 0u ? v.position : positions.at[vertex];
    positions.at[vertex] = v.position;
    vec3 normal = unitOr(v.normal, rest.at[vertex].normal);
    attributes.at[vertex].normal = packSnorm2x16(octahedralFromUnit(normal));
    if (v.tangent.w != 0.0) {
        uint bits = packSnorm2x16(octahedralFromUnit(unitOr(v.tangent.xyz, vec3(1.0, 0.0, 0.0))));
        attributes.at[vertex].tangent = (bits & ~1u) | (v.tangent.w < 0.0 ? 1u : 0u);
    }
}
