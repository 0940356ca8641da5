// The surface that a ray has hit: where it is, how it is turned, and what it is made of.
#ifndef VIEWER_SURFACE
#define VIEWER_SURFACE

#include "viewer/ggx.glsl"
#include "viewer/material.glsl"

struct Surface {
    vec3 position;
    vec3 geometricNormal; // unit length, on the side that the ray came from
    vec3 normal; // of shading, on that side too
    vec3 coatNormal; // of the clear coat
    bool isFront;
    uint material;
    uint flags; // of the material
    vec3 baseColor;
    float metalness;
    float roughness;
    float transmission;
    float ior;
    vec3 f0; // of the dielectric, straight on
    float f90; // at grazing angles
    vec3 emission;
    float coat;
    float coatRoughness;
    vec3 sheenColor;
    float sheenRoughness;
};

// A normal that the ray cannot see from behind is turned just so far that it can.
vec3 seenNormal(vec3 normal, vec3 geometricNormal, vec3 view) {
    float facing = dot(normal, view);
    if (facing >= 1e-3) {
        return normal;
    }
    vec3 turned = normalize(normal + (1e-3 - facing) * view);
    return dot(turned, view) > 0.0 ? turned : geometricNormal;
}

vec3 mappedNormal(Surface surface, vec3 tangent, float side, Texcoords texcoords, float footprint, vec3 normal) {
    vec3 texel = texelOf(surface.material, kSlotNormal, texcoords, footprint).xyz * 2.0 - 1.0;
    texel.xy *= frame.materials.at[surface.material].normalScale;
    vec3 t = tangent - dot(tangent, normal) * normal;
    float length2 = dot(t, t);
    if (length2 < 1e-12) {
        return normal;
    }
    t *= inversesqrt(length2);
    return normalize(texel.x * t + side * texel.y * cross(normal, t) + max(texel.z, 1e-3) * normal);
}

void setNormals(inout Surface surface, Instance instance, Geometry geometry, uvec3 corners, vec3 weights,
                Texcoords texcoords, vec3 view, float footprint) {
    AttributesArray all = AttributesArray(geometry.attributes);
    vec3 smoothed = weights.x * unpackedNormal(all.at[corners.x].normal) + weights.y * unpackedNormal(all.at[corners.y].normal) +
                    weights.z * unpackedNormal(all.at[corners.z].normal);
    vec3 normal = normalToWorld(instance, smoothed);
    float length2 = dot(normal, normal);
    normal = length2 > 0.0 ? normal * inversesqrt(length2) : surface.geometricNormal;
    // The front is where the triangle turns counter-clockwise; normals of the back are turned.
    normal = surface.isFront ? normal : -normal;
    surface.coatNormal = seenNormal(normal, surface.geometricNormal, view);
    if (frame.materials.at[surface.material].slots[kSlotNormal] != kNoTexture) {
        vec3 tangent = weights.x * unpackedNormal(all.at[corners.x].tangent & ~1u) +
                       weights.y * unpackedNormal(all.at[corners.y].tangent & ~1u) +
                       weights.z * unpackedNormal(all.at[corners.z].tangent & ~1u);
        float side = (all.at[corners.x].tangent & 1u) != 0u ? -1.0 : 1.0;
        normal = mappedNormal(surface, vectorToWorld(instance, tangent), surface.isFront ? side : -side, texcoords, footprint, normal);
    }
    surface.normal = seenNormal(normal, surface.geometricNormal, view);
}

void setMaterial(inout Surface surface, Texcoords texcoords, float footprint) {
    uint number = surface.material;
    MaterialArray all = frame.materials;
    vec4 metalRough = texelOf(number, kSlotMetalRough, texcoords, footprint);
    surface.metalness = clamp(all.at[number].metalness * metalRough.b, 0.0, 1.0);
    surface.roughness = clamp(all.at[number].roughness * metalRough.g, 0.0, 1.0);
    surface.emission = all.at[number].emission * texelOf(number, kSlotEmission, texcoords, footprint).rgb;
    surface.transmission = all.at[number].transmission * texelOf(number, kSlotTransmission, texcoords, footprint).r;
    surface.ior = all.at[number].ior;
    float specular = all.at[number].specular * texelOf(number, kSlotSpecular, texcoords, footprint).a;
    vec3 specularColor = all.at[number].specularColor * texelOf(number, kSlotSpecularColor, texcoords, footprint).rgb;
    float straight = (surface.ior - 1.0) / (surface.ior + 1.0);
    surface.f0 = min(straight * straight * specularColor, vec3(1.0)) * specular;
    surface.f90 = specular;
    surface.coat = all.at[number].coat * texelOf(number, kSlotCoat, texcoords, footprint).r;
    surface.coatRoughness = all.at[number].coatRoughness * texelOf(number, kSlotCoatRoughness, texcoords, footprint).g;
    surface.sheenColor = all.at[number].sheenColor * texelOf(number, kSlotSheenColor, texcoords, footprint).rgb;
    surface.sheenRoughness = all.at[number].sheenRoughness * texelOf(number, kSlotSheenRoughness, texcoords, footprint).a;
}

// `width`: of the ray at the surface; 0 for texels of the largest mip.
Surface surfaceAt(Hit hit, vec3 direction, float width) {
    Instance instance = frame.instances.at[hit.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + hit.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    vec3 weights = weightsOf(hit.barycentrics);
    vec3 a = toWorld(instance, positionOf(geometry, corners.x));
    vec3 b = toWorld(instance, positionOf(geometry, corners.y));
    vec3 c = toWorld(instance, positionOf(geometry, corners.z));
    AttributesArray all = AttributesArray(geometry.attributes);
    Surface surface;
    surface.material = geometry.material;
    surface.flags = frame.materials.at[geometry.material].flags;
    surface.position = weights.x * a + weights.y * b + weights.z * c;
    // Mirroring instances turn triangles over; their normals tell the front.
    vec3 across = cross(b - a, c - a);
    vec3 outwards = normalToWorld(instance, cross(positionOf(geometry, corners.y) - positionOf(geometry, corners.x),
                                                  positionOf(geometry, corners.z) - positionOf(geometry, corners.x)));
    across = dot(across, outwards) < 0.0 ? -across : across;
    float area = length(across);
    vec3 front = area > 0.0 ? across / area : -direction;
    surface.isFront = dot(front, direction) < 0.0;
    surface.geometricNormal = surface.isFront ? front : -front;
    Texcoords texcoords = texcoordsOf(all, corners, weights);
    float footprint = 0.0;
    if (width > 0.0) {
        vec2 e1 = all.at[corners.y].texcoords[0] - all.at[corners.x].texcoords[0];
        vec2 e2 = all.at[corners.z].texcoords[0] - all.at[corners.x].texcoords[0];
        float density = sqrt(abs(e1.x * e2.y - e1.y * e2.x) / max(area, 1e-30));
        footprint = density * width / sqrt(max(abs(dot(front, direction)), 0.05));
    }
    surface.baseColor = baseColorOf(surface.material, all, corners, weights, texcoords, footprint).rgb;
    setMaterial(surface, texcoords, footprint);
    setNormals(surface, instance, geometry, corners, weights, texcoords, -direction, footprint);
    return surface;
}

#endif
