// Light of triangles that glow.
#ifndef VIEWER_EMITTERS
#define VIEWER_EMITTERS

#include "viewer/material.glsl"

// A ray goes no farther.
const float kFar = 1e30;

// A direction to light, drawn by chance.
struct Arriving {
    vec3 direction;
    float distance;
    vec3 radiance; // over the density; for a lamp, its irradiance over the chance to be chosen
    float density; // per solid angle; 0 for a lamp, which no scattered ray meets
};

// The density per solid angle with which drawEmitter() chooses a point of a geometry, `distance` away on a triangle that is seen at
// an angle with this cosine.
float emitterDensity(float weight, float distance, float cosine) {
    float perArea = frame.emitterCount > 0u ? frame.emitterProbability * weight / frame.emitterPower : 0.0;
    return perArea * distance * distance / max(cosine, 1e-6);
}

// The first emitter whose chance is above `choice`.
uint emitterAt(float choice) {
    uint low = 0u;
    uint high = frame.emitterCount - 1u;
    while (low < high) {
        uint middle = (low + high) / 2u;
        bool isBelow = frame.emitters.at[middle].chance <= choice;
        low = isBelow ? middle + 1u : low;
        high = isBelow ? high : middle;
    }
    return low;
}

// Draws a point of an emitter, all of whose points are alike.
Arriving drawEmitter(vec3 position, float choice, vec2 u) {
    Emitter emitter = frame.emitters.at[emitterAt(choice)];
    Instance instance = frame.instances.at[emitter.instance];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + emitter.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[emitter.primitive];
    vec3 a = toWorld(instance, positionOf(geometry, corners.x));
    vec3 b = toWorld(instance, positionOf(geometry, corners.y));
    vec3 c = toWorld(instance, positionOf(geometry, corners.z));
    float root = sqrt(u.x);
    vec3 weights = vec3(1.0 - root, root * (1.0 - u.y), root * u.y);
    vec3 way = weights.x * a + weights.y * b + weights.z * c - position;
    float distance = max(length(way), 1e-6);
    vec3 direction = way / distance;
    vec3 across = cross(b - a, c - a);
    float area = length(across);
    float cosine = area > 0.0 ? abs(dot(across, direction)) / area : 0.0;
    float density = emitterDensity(geometry.emissionWeight, distance, cosine);
    Texcoords texcoords = texcoordsOf(AttributesArray(geometry.attributes), corners, weights);
    vec3 emission = frame.materials.at[geometry.material].emission * texelOf(geometry.material, kSlotEmission, texcoords, vec2(0.0)).rgb;
    return Arriving(direction, distance, cosine > 1e-6 && density > 0.0 ? emission / density : vec3(0.0), density);
}

#endif
