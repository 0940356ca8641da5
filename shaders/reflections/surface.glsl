// The surface that a ray met, from the table of geometries: whatever the model's layout in memory.
#ifndef REFLECTIONS_SURFACE
#define REFLECTIONS_SURFACE

#include "common/octahedral.glsl"
#include "reflections/frame.glsl"

const uint kNothing = 0xffffffffu;

struct Hit {
    uint instance; // the custom index: a place in the table of instances; or kNothing
    uint geometry; // of the model
    uint primitive;
    vec2 barycentrics;
    float distance;
};

struct Surface {
    vec3 position;
    vec3 normal; // unit length, on the viewer's side
    vec3 geometricNormal; // likewise
    vec3 albedo; // linear
    float roughness;
    float metalness;
    vec3 emission;
    float opacity;
};

uint indexAt(uvec2 indices, uint place) {
    uint pair = Words(indices).at[place >> 1u];
    return (place & 1u) == 0u ? pair & 0xffffu : pair >> 16u;
}

uvec3 cornersOf(Geometry geometry, uint primitive) {
    return uvec3(indexAt(geometry.indices, 3u * primitive), indexAt(geometry.indices, 3u * primitive + 1u),
                 indexAt(geometry.indices, 3u * primitive + 2u));
}

vec3 moved(Instance instance, vec3 p) {
    vec4 h = vec4(p, 1.0);
    return vec3(dot(instance.rows[0], h), dot(instance.rows[1], h), dot(instance.rows[2], h));
}

vec3 turned(Instance instance, vec3 n) {
    return instance.normalColumns[0] * n.x + instance.normalColumns[1] * n.y + instance.normalColumns[2] * n.z;
}

vec3 floatPosition(Words vertices, uint vertex) {
    return uintBitsToFloat(uvec3(vertices.at[3u * vertex], vertices.at[3u * vertex + 1u], vertices.at[3u * vertex + 2u]));
}

vec3 vertexPosition(Geometry geometry, Instance instance, uint vertex) {
    Words vertices = Words(geometry.vertices);
    if (geometry.kind != kKindStatic) {
        return floatPosition(vertices, vertex);
    }
    vec2 xy = unpackSnorm2x16(vertices.at[4u * vertex]);
    return moved(instance, vec3(xy, unpackSnorm2x16(vertices.at[4u * vertex + 1u]).x));
}

vec3 vertexNormal(Geometry geometry, Instance instance, uint vertex) {
    if (geometry.kind == kKindStatic) {
        return turned(instance, unitFromOctahedral(unpackSnorm2x16(Words(geometry.vertices).at[4u * vertex + 2u])));
    }
    if (geometry.kind == kKindSkinned) {
        return unitFromOctahedral(unpackSnorm2x16(Words(geometry.normals).at[vertex]));
    }
    return -frame.camera.forward;
}

vec2 vertexTexcoord(Geometry geometry, uint vertex) {
    if (geometry.kind == kKindStatic) {
        return unpackHalf2x16(Words(geometry.vertices).at[4u * vertex + 3u]);
    }
    return vec2(vertex & 1u, (vertex >> 1u) & 1u);
}

vec2 texcoordOf(Geometry geometry, uint primitive, vec2 b) {
    uvec3 corner = cornersOf(geometry, primitive);
    vec2 uv0 = vertexTexcoord(geometry, corner.x);
    return uv0 + b.x * (vertexTexcoord(geometry, corner.y) - uv0) + b.y * (vertexTexcoord(geometry, corner.z) - uv0);
}

// Leaves of a quad differ in colour.
vec3 leafTint(uint quad) {
    float k = fract(float(quad) * 0.6180339887);
    return mix(vec3(1.0, 0.25, 0.06), vec3(1.0, 0.72, 0.18), k);
}

// True if the leaf's texture is solid at a hit: the test of the any-hit shader, and of queries.
bool isSolid(uint instance, uint geometry, uint primitive, vec2 b) {
    Geometry leaf = frame.geometries.at[frame.instances.at[instance].firstGeometry + geometry];
    Material material = frame.materials.at[leaf.material];
    vec2 uv = texcoordOf(leaf, primitive, b);
    return textureBindless2DLod(material.albedoTexture, frame.surfaceSampler, uv, 0.0).a >= 0.5;
}

// `coneWidth` is the footprint at the hit, across the ray.
Surface surfaceOf(Hit hit, vec3 direction, float coneWidth) {
    Instance instance = frame.instances.at[hit.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + hit.geometry];
    Material material = frame.materials.at[geometry.material];
    uvec3 corner = cornersOf(geometry, hit.primitive);
    vec3 p0 = vertexPosition(geometry, instance, corner.x);
    vec3 edge1 = vertexPosition(geometry, instance, corner.y) - p0;
    vec3 edge2 = vertexPosition(geometry, instance, corner.z) - p0;
    vec3 n0 = vertexNormal(geometry, instance, corner.x);
    vec3 n = n0 + hit.barycentrics.x * (vertexNormal(geometry, instance, corner.y) - n0) +
             hit.barycentrics.y * (vertexNormal(geometry, instance, corner.z) - n0);

    Surface surface;
    surface.position = p0 + hit.barycentrics.x * edge1 + hit.barycentrics.y * edge2;
    vec3 geometric = normalize(cross(edge1, edge2));
    surface.geometricNormal = dot(geometric, direction) > 0.0 ? -geometric : geometric;
    surface.normal = normalize(dot(n, surface.geometricNormal) < 0.0 ? -n : n);
    surface.albedo = material.albedo;
    surface.roughness = material.roughness;
    if (material.albedoTexture != kNoTexture) {
        float footprint = coneWidth / max(sqrt(abs(dot(direction, geometric))), 0.2);
        float lod = log2(max(footprint * material.texelsPerUnit, 1.0));
        vec2 uv = texcoordOf(geometry, hit.primitive, hit.barycentrics);
        vec4 texel = textureBindless2DLod(material.albedoTexture, frame.surfaceSampler, uv, lod);
        surface.albedo *= texel.rgb;
        surface.roughness *= geometry.kind == kKindLeaf ? 1.0 : texel.a;
    }
    if (geometry.kind == kKindLeaf) {
        surface.albedo *= leafTint(hit.primitive >> 1u);
    }
    surface.metalness = material.metalness;
    surface.emission = material.emission;
    surface.opacity = material.opacity;
    return surface;
}

#endif
