// What a ray does at a triangle that may have holes: masks, coverage, thin glass, and backs that the eye does not see.
#ifndef VIEWER_CANDIDATE
#define VIEWER_CANDIDATE

#include "viewer/albedo.glsl"
#include "viewer/material.glsl"
#include "viewer/random.glsl"
#include "viewer/thin.glsl"

// True if the ray goes on behind the triangle. A ray that looks for the nearest surface meets a share of alpha of all rays, by
// chance; a shadow ray goes through, with less light.
bool passesThrough(Hit hit, vec3 direction, inout Payload payload) {
    Instance instance = frame.instances.at[hit.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + hit.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    uint flags = frame.materials.at[geometry.material].flags;
    bool isShadow = payload.seed == kShadow;
    if (!isShadow && (payload.seed & kJudgesBacks) != 0u && isUnseenBack(hit, direction)) {
        return true;
    }
    bool isTransmissive = frame.materials.at[geometry.material].transmission > 0.0;
    if ((flags & (kAlphaMask | kAlphaBlend)) == 0u && !(isShadow && isTransmissive)) {
        return false;
    }
    AttributesArray all = AttributesArray(geometry.attributes);
    vec3 weights = weightsOf(hit.barycentrics);
    Texcoords texcoords = texcoordsOf(all, corners, weights);
    vec4 color = baseColorOf(geometry.material, all, corners, weights, texcoords, vec2(0.0));
    if ((flags & kAlphaMask) != 0u && color.a < frame.materials.at[geometry.material].alphaCutoff) {
        return true;
    }
    float covered = (flags & kAlphaBlend) != 0u ? clamp(color.a, 0.0, 1.0) : 1.0;
    if (!isShadow) {
        uint place = hashWords(hashWords(payload.seed & ~kJudgesBacks, hit.instance), hashWords(hit.geometry, hit.primitive));
        return covered < 1.0 && unitFloat(place) >= covered;
    }
    vec3 through = vec3(0.0);
    if (isTransmissive) {
        // The same normal as where the path itself goes through.
        Surface surface = surfaceAt(hit, direction, 0.0);
        through = isPane(surface) ? paneTransmittance(surface, direction) : vec3(0.0);
    }
    payload.transmittance *= 1.0 - covered + covered * through;
    return any(greaterThan(payload.transmittance, vec3(0.0)));
}

#endif
