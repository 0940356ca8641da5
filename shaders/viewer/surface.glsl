// The surface that a ray has hit: where it is, how it is turned, and what it is made of.
#ifndef VIEWER_SURFACE
#define VIEWER_SURFACE

#include "viewer/iridescence.glsl"
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
    float roughness; // of both directions together
    vec2 alpha; // along the tangent, and across it
    vec3 tangent; // in the plane of the shading normal, unit length; 0 where alpha is the same all around
    float transmission;
    float ior;
    vec3 metalF0; // of the metal, straight on
    vec3 f0; // of the dielectric
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

// The normal that a normal map has instead of `normal`, where `t` and `b` are tangent and bitangent.
vec3 mappedNormal(vec3 texel, float scale, vec3 t, vec3 b, vec3 normal) {
    vec3 mapped = texel * 2.0 - 1.0;
    mapped.xy *= scale;
    return normalize(mapped.x * t + mapped.y * b + max(mapped.z, 1e-3) * normal);
}

// Turns the surface by its normal maps, and finds the direction of its anisotropy.
void setDetails(inout Surface surface, vec3 tangent, float side, Texcoords texcoords, vec2 footprints, inout vec3 normal,
                inout vec3 coatNormal) {
    MaterialArray all = frame.materials;
    uint number = surface.material;
    vec3 t = tangent - dot(tangent, normal) * normal;
    float length2 = dot(t, t);
    if (length2 < 1e-12) {
        surface.tangent = vec3(0.0);
        return;
    }
    t *= inversesqrt(length2);
    vec3 b = side * cross(normal, t);
    vec3 smoothed = normal;
    if (all.at[number].slots[kSlotNormal] != kNoTexture) {
        vec3 texel = texelOf(number, kSlotNormal, texcoords, footprints).xyz;
        normal = mappedNormal(texel, all.at[number].normalScale, t, b, smoothed);
    }
    if (all.at[number].slots[kSlotCoatNormal] != kNoTexture) {
        vec3 texel = texelOf(number, kSlotCoatNormal, texcoords, footprints).xyz;
        coatNormal = mappedNormal(texel, all.at[number].coatNormalScale, t, b, smoothed);
    }
    surface.tangent = surface.tangent.x * t + surface.tangent.y * b;
}

void setNormals(inout Surface surface, Instance instance, Geometry geometry, uvec3 corners, vec3 weights,
                Texcoords texcoords, vec3 view, vec2 footprints) {
    AttributesArray all = AttributesArray(geometry.attributes);
    vec3 smoothed = weights.x * unpackedNormal(all.at[corners.x].normal) + weights.y * unpackedNormal(all.at[corners.y].normal) +
                    weights.z * unpackedNormal(all.at[corners.z].normal);
    vec3 normal = normalToWorld(instance, smoothed);
    float length2 = dot(normal, normal);
    normal = length2 > 0.0 ? normal * inversesqrt(length2) : surface.geometricNormal;
    // The front is where the triangle turns counter-clockwise; normals of the back are turned.
    normal = surface.isFront ? normal : -normal;
    vec3 coatNormal = normal;
    if ((surface.flags & kTangents) != 0u) {
        vec3 tangent = weights.x * unpackedNormal(all.at[corners.x].tangent & ~1u) +
                       weights.y * unpackedNormal(all.at[corners.y].tangent & ~1u) +
                       weights.z * unpackedNormal(all.at[corners.z].tangent & ~1u);
        float side = (all.at[corners.x].tangent & 1u) != 0u ? -1.0 : 1.0;
        setDetails(surface, vectorToWorld(instance, tangent), surface.isFront ? side : -side, texcoords, footprints, normal, coatNormal);
    }
    surface.normal = seenNormal(normal, surface.geometricNormal, view);
    surface.coatNormal = seenNormal(coatNormal, surface.geometricNormal, view);
}

// Roughness along the tangent and across it, and that of both together.
void setRoughness(inout Surface surface, Texcoords texcoords, vec2 footprints) {
    MaterialArray all = frame.materials;
    uint number = surface.material;
    surface.tangent = vec3(0.0);
    surface.alpha = vec2(alphaOf(surface.roughness));
    if (all.at[number].anisotropy > 0.0) {
        vec3 texel = vec3(1.0, 0.5, 1.0);
        if (all.at[number].slots[kSlotAnisotropy] != kNoTexture) {
            texel = texelOf(number, kSlotAnisotropy, texcoords, footprints).xyz;
        }
        vec2 along = texel.xy * 2.0 - 1.0;
        float length2 = dot(along, along);
        along = length2 > 1e-6 ? along * inversesqrt(length2) : vec2(1.0, 0.0);
        vec2 turned = all.at[number].anisotropyDirection;
        surface.tangent = vec3(turned.x * along.x - turned.y * along.y, turned.y * along.x + turned.x * along.y, 0.0);
        float strength = clamp(all.at[number].anisotropy * texel.z, 0.0, 1.0);
        surface.alpha.x = mix(surface.alpha.x, 1.0, strength * strength);
        // A round highlight of this roughness loses about as much light between microfacets, within 8 %.
        float mean = 0.5 * (surface.alpha.x + surface.alpha.y);
        surface.roughness = sqrt(mix(mean, sqrt(0.5 * dot(surface.alpha, surface.alpha)), 0.6));
    }
}

// What a thin film does to the reflectance straight on, for the angle of the view.
void addFilm(inout Surface surface, Texcoords texcoords, vec2 footprints, vec3 view) {
    MaterialArray all = frame.materials;
    uint number = surface.material;
    if ((surface.flags & kExtensions) == 0u || all.at[number].film <= 0.0) {
        return;
    }
    float share = all.at[number].film * texelOf(number, kSlotFilm, texcoords, footprints).r;
    float place = texelOf(number, kSlotFilmThickness, texcoords, footprints).g;
    float thickness = mix(all.at[number].filmThickness.x, all.at[number].filmThickness.y, place);
    float cosine = clamp(dot(surface.normal, view), 0.0, 1.0);
    surface.metalF0 = mix(surface.metalF0, filmF0(surface.metalF0, all.at[number].filmIor, thickness, cosine), share);
    surface.f0 = mix(surface.f0, filmF0(surface.f0, all.at[number].filmIor, thickness, cosine), share);
}

// What most materials lack. `straight`: reflectance straight on by the index of refraction.
void setExtensions(inout Surface surface, float straight, Texcoords texcoords, vec2 footprints) {
    uint number = surface.material;
    MaterialArray all = frame.materials;
    surface.transmission = all.at[number].transmission * texelOf(number, kSlotTransmission, texcoords, footprints).r;
    float specular = all.at[number].specular * texelOf(number, kSlotSpecular, texcoords, footprints).a;
    vec3 specularColor = all.at[number].specularColor * texelOf(number, kSlotSpecularColor, texcoords, footprints).rgb;
    surface.f0 = min(straight * specularColor, vec3(1.0)) * specular;
    surface.f90 = specular;
    surface.coat = all.at[number].coat * texelOf(number, kSlotCoat, texcoords, footprints).r;
    surface.coatRoughness = all.at[number].coatRoughness * texelOf(number, kSlotCoatRoughness, texcoords, footprints).g;
    surface.sheenColor = all.at[number].sheenColor * texelOf(number, kSlotSheenColor, texcoords, footprints).rgb;
    surface.sheenRoughness = all.at[number].sheenRoughness * texelOf(number, kSlotSheenRoughness, texcoords, footprints).a;
}

void setMaterial(inout Surface surface, Texcoords texcoords, vec2 footprints) {
    uint number = surface.material;
    MaterialArray all = frame.materials;
    vec4 metalRough = texelOf(number, kSlotMetalRough, texcoords, footprints);
    surface.metalness = clamp(all.at[number].metalness * metalRough.b, 0.0, 1.0);
    surface.roughness = clamp(all.at[number].roughness * metalRough.g, 0.0, 1.0);
    setRoughness(surface, texcoords, footprints);
    surface.emission = all.at[number].emission * texelOf(number, kSlotEmission, texcoords, footprints).rgb;
    surface.ior = all.at[number].ior;
    surface.metalF0 = surface.baseColor;
    float straight = (surface.ior - 1.0) / (surface.ior + 1.0);
    surface.f0 = vec3(min(straight * straight, 1.0));
    surface.f90 = 1.0;
    surface.transmission = 0.0;
    surface.coat = 0.0;
    surface.coatRoughness = 0.0;
    surface.sheenColor = vec3(0.0);
    surface.sheenRoughness = 0.0;
    if ((surface.flags & kExtensions) != 0u) {
        setExtensions(surface, straight * straight, texcoords, footprints);
    }
}

// Texture coordinates that a ray covers whose cone is `width` wide on a triangle, of each set: the root of their area.
vec2 footprintsOf(AttributesArray all, uvec3 corners, float area, float width) {
    vec2 footprints;
    for (uint set = 0u; set < 2u; ++set) {
        vec2 e1 = all.at[corners.y].texcoords[set] - all.at[corners.x].texcoords[set];
        vec2 e2 = all.at[corners.z].texcoords[set] - all.at[corners.x].texcoords[set];
        footprints[set] = width * sqrt(abs(e1.x * e2.y - e1.y * e2.x) / max(area, 1e-30));
    }
    return footprints;
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
    across = dot(across, outwards(instance, geometry, corners)) < 0.0 ? -across : across;
    float area = length(across);
    vec3 front = area > 0.0 ? across / area : -direction;
    surface.isFront = dot(front, direction) < 0.0;
    surface.geometricNormal = surface.isFront ? front : -front;
    Texcoords texcoords = texcoordsOf(all, corners, weights);
    vec2 footprints = vec2(0.0);
    if (width > 0.0) {
        footprints = footprintsOf(all, corners, area, width / sqrt(max(abs(dot(front, direction)), 0.05)));
    }
    surface.baseColor = baseColorOf(surface.material, all, corners, weights, texcoords, footprints).rgb;
    setMaterial(surface, texcoords, footprints);
    setNormals(surface, instance, geometry, corners, weights, texcoords, -direction, footprints);
    addFilm(surface, texcoords, footprints, -direction);
    return surface;
}

#endif
