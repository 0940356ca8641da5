// The point of a surface that a ray met or a pixel shows, and how it is interpolated from its triangle.
// The including file provides `frame.scene` before. It is reached in place: SwiftShader miscompiles copies of structs that
// hold buffer references.
#ifndef COMMON_SURFACE
#define COMMON_SURFACE

#include "common/ray_triangle.glsl"
#include "common/scene_buffers.glsl"
#include "common/texture_lod.glsl"

struct SurfacePoint {
    vec3 position;
    float distance; // along the ray that found it
    vec3 normal; // interpolated, unit length, on the outer side
    vec3 geometricNormal; // of the triangle, unit length, on the outer side
    vec3 albedo; // linear
    uint triangle;
};

// Intersection of a ray with a triangle that is known to be in its way. The result is pulled into the triangle: a rasteriser
// also covers pixels whose centre misses it by a rounding error.
vec2 barycentricsAlong(uint triangle, vec3 origin, vec3 direction) {
    uvec3 corner = frame.scene.triangles.at[triangle];
    vec3 volumes = passageOf(direction, frame.scene.positions.at[corner.x] - origin,
                             frame.scene.positions.at[corner.y] - origin,
                             frame.scene.positions.at[corner.z] - origin).volumes;
    float sum = volumes.x + volumes.y + volumes.z;
    if (sum == 0.0) {
        return vec2(1.0 / 3.0);
    }
    vec2 b = clamp(volumes.yz / sum, vec2(0.0), vec2(1.0));
    return b / max(b.x + b.y, 1.0);
}

// Colour of the vertices between them.
vec3 vertexColor(uvec3 corner, vec2 b) {
    if (frame.scene.colors == uvec2(0u)) {
        return vec3(1.0);
    }
    Vec3Array colors = Vec3Array(frame.scene.colors);
    vec3 c0 = colors.at[corner.x];
    return c0 + b.x * (colors.at[corner.y] - c0) + b.y * (colors.at[corner.z] - c0);
}

vec3 sampleAlbedo(TriangleInfo info, uvec3 corner, vec2 b, float coneWidth, float cosine, uint smp) {
    Material material = frame.scene.materials.at[info.material];
    vec3 albedo = material.albedo * vertexColor(corner, b);
    if (material.albedoTexture == kNoTexture) {
        return albedo;
    }
    vec2 uv0 = frame.scene.texcoords.at[corner.x];
    vec2 uv = uv0 + b.x * (frame.scene.texcoords.at[corner.y] - uv0) +
              b.y * (frame.scene.texcoords.at[corner.z] - uv0);
    float lod = coneTextureLod(info.lodConstant, coneWidth, cosine);
    return albedo * textureBindless2DLod(material.albedoTexture, smp, uv, lod).rgb;
}

// `coneWidth` is the footprint at the ray's origin, `spread` its growth per unit of distance.
SurfacePoint surfaceAt(uint triangle, vec2 b, vec3 origin, vec3 direction, float coneWidth, float spread, uint smp) {
    uvec3 corner = frame.scene.triangles.at[triangle];
    vec3 p0 = frame.scene.positions.at[corner.x];
    vec3 edge1 = frame.scene.positions.at[corner.y] - p0;
    vec3 edge2 = frame.scene.positions.at[corner.z] - p0;
    vec3 n0 = frame.scene.normals.at[corner.x];
    vec3 n = n0 + b.x * (frame.scene.normals.at[corner.y] - n0) + b.y * (frame.scene.normals.at[corner.z] - n0);

    SurfacePoint point;
    point.position = p0 + b.x * edge1 + b.y * edge2;
    point.distance = dot(point.position - origin, direction);
    vec3 geometricNormal = normalize(cross(edge1, edge2));
    // The vertex normals, not the winding, say which side is outside: files in the wild mix windings.
    point.geometricNormal = dot(geometricNormal, n) < 0.0 ? -geometricNormal : geometricNormal;
    float squaredLength = dot(n, n);
    point.normal = squaredLength > 1e-12 ? n * inversesqrt(squaredLength) : point.geometricNormal;
    point.triangle = triangle;
    float width = coneWidth + spread * point.distance;
    float cosine = dot(direction, point.geometricNormal);
    point.albedo = sampleAlbedo(frame.scene.triangleInfos.at[triangle], corner, b, width, cosine, smp);
    return point;
}

#endif
