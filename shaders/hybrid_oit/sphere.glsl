// Intersection of a ray with a sphere, and the transmittance of glass.
//
// No ray of this sample needs a gap behind its origin. A point on a ball sends rays only to the outer side, and from
// there they move away from the centre of a convex body: its own sphere is behind them, and crossSphere() says so
// without any tolerance. What the rounding of the point itself could spoil, the common offset along the normal mends.
#ifndef HYBRID_OIT_SPHERE
#define HYBRID_OIT_SPHERE

#include "hybrid_oit/frame.glsl"

struct Crossing {
    float entry; // distance along the ray; negative where the ray starts inside
    float exit;
    float cosine; // between the ray and the surface's normal, at both ends
};

// True if a ray of unit direction crosses the sphere in front of its origin. The discriminant is taken from the
// closest point's distance, which stays exact for far and small spheres.
bool crossSphere(vec3 center, float radius, vec3 origin, vec3 direction, out Crossing crossing) {
    precise vec3 toCenter = center - origin;
    precise float middle = dot(toCenter, direction);
    precise vec3 closest = toCenter - middle * direction;
    precise float squaredHalf = radius * radius - dot(closest, closest);
    crossing = Crossing(0.0, 0.0, 0.0);
    if (squaredHalf <= 0.0) {
        return false;
    }
    precise float halfChord = sqrt(squaredHalf);
    bool isOutside = dot(toCenter, toCenter) >= radius * radius;
    if (isOutside && middle <= 0.0) {
        return false;
    }
    precise float entry = middle - halfChord;
    precise float exit = middle + halfChord;
    crossing = Crossing(isOutside ? max(entry, 0.0) : entry, exit, min(halfChord / radius, 1.0));
    return true;
}

// Schlick's reflectance of a boundary of glass.
float glassReflectance(float cosine) {
    const float straight = 0.04;
    float grazing = 1.0 - cosine;
    float squared = grazing * grazing;
    return straight + (1.0 - straight) * squared * squared * grazing;
}

// Optical depths (-log of transmittance) as whole numbers add up to the same sum in any order, so that a shadow does
// not depend on the order in which a driver finds the spheres.
const float kDepthUnits = 65536.0;
const float kLargestDepth = 64.0;

// Absorption of a sphere of glass along a shadow ray that starts `start` behind the origin of the crossing.
uvec3 glassOpticalDepth(Crossing crossing, vec3 absorption, float start) {
    float inside = crossing.exit - max(crossing.entry, start);
    float boundaries = crossing.entry >= start ? 2.0 : 1.0;
    float reflected = min(glassReflectance(crossing.cosine), 0.999);
    vec3 depth = absorption * inside - boundaries * log(1.0 - reflected);
    return uvec3(min(depth, vec3(kLargestDepth)) * kDepthUnits + 0.5);
}

vec3 transmittanceOf(uvec3 opticalDepth) {
    return exp(-vec3(opticalDepth) / kDepthUnits);
}

#endif
