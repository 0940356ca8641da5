// Paths of light from the camera. At each surface a shadow ray looks for light, and the path goes on in a direction that the surface
// prefers; light that both can find is shared between them. The including file provides traceWithin() and transmittanceTo().
#ifndef VIEWER_PATH
#define VIEWER_PATH

#include "common/ray_offset.glsl"
#include "viewer/lights.glsl"
#include "viewer/nearest_ray.glsl"

// Surfaces of a path before chance may end it.
const uint kSureBounces = 3u;
// Least density per solid angle of a direction in which a scattered ray finds lights that are near; the including file may define
// another. Shadow rays have all of their light that comes from others.
#ifndef LEAST_DENSITY
#define LEAST_DENSITY 0.0
#endif
// Angle of the cone that a scattered ray stands for, over the root of the solid angle of one that is as likely.
const float kConeShare = 0.25;

vec3 leaveTo(Surface surface, vec3 direction) {
    bool isAbove = dot(direction, surface.geometricNormal) > 0.0;
    return leaveSurface(surface.position, isAbove ? surface.geometricNormal : -surface.geometricNormal, frame.offsetExtent);
}

// The extinction on the side of a surface that a direction leads to, of which `before` is on that of the path so far.
vec3 extinctionTowards(Surface surface, vec3 direction, vec3 before) {
    if ((surface.flags & kThin) != 0u || dot(direction, surface.geometricNormal) > 0.0) {
        return before;
    }
    return surface.isFront ? frame.materials.at[surface.material].extinction : vec3(0.0);
}

// A shadow ray that is to be traced when the path knows its way on, so that the surface need not be kept meanwhile: what is alive while
// a ray is traced lies in memory.
struct ShadowRay {
    vec3 origin;
    vec3 direction;
    float range;
    vec3 light; // that the surface returns where nothing is in the way of the ray
    vec3 matte; // of it what the matte layer scatters
};

// True for light from outside of the scene, which any scattered ray finds if there is a sky.
bool isBeyond(Arriving arriving) {
    return arriving.distance >= kFar && frame.skyProbability > 0.0;
}

// A ray to one light or to the sky, drawn by chance. `extinction`: of the volume that the path came through. The ray does not begin on
// the surface but a little above it, so it is aimed anew: along the direction from the surface, it would meet a light that stands low
// over the surface before its range ends.
ShadowRay shadowRay(Surface surface, Bsdf bsdf, vec3 extinction, float choice, vec2 u) {
    Arriving arriving = drawLight(surface.position, choice, u);
    Response response = respond(surface, bsdf, arriving.direction);
    bool isFoundTwice = arriving.density > 0.0 && (response.density >= LEAST_DENSITY || isBeyond(arriving));
    float share = isFoundTwice ? powerShare(arriving.density, response.density) : 1.0;
    vec3 light = share * arriving.radiance;
    ShadowRay ray = ShadowRay(leaveTo(surface, arriving.direction), arriving.direction, kFar, vec3(0.0), vec3(0.0));
    if (arriving.distance < kFar) {
        light *= exp(-extinctionTowards(surface, arriving.direction, extinction) * arriving.distance);
        vec3 way = surface.position + arriving.distance * arriving.direction - ray.origin;
        float distance = max(length(way), 1e-6);
        ray.direction = way / distance;
        ray.range = 0.9999 * distance;
    }
    ray.light = light * response.value;
    ray.matte = light * response.matte;
    return ray;
}

// A path from the eye.
Path cameraPath(vec3 direction) {
    vec3 eye = frame.camera.eye;
    return Path(eye, direction, -1.0, eye, vec3(0.0), 1.0, 0.0, 0.0, 0u, 0u, vec3(1.0), vec3(0.0));
}

Path loadPath(uint place, inout Random random) {
    random.pair = frame.paths.at[place].pair;
    return frame.paths.at[place].path;
}

void storePath(uint place, Path path, Random random) {
    frame.paths.at[place].path = path;
    frame.paths.at[place].pair = random.pair;
}

// The next surface on the way of a path, up to `range` away; at that distance where there is none.
Hit nextHit(inout Path path, float range, Random random) {
    uint number = hashWords(random.seed + path.bounce, random.number);
    return nearestHit(path.origin, path.direction, range, number, path.bounce == 0u, path.rayCount);
}

// The surface at a hit. The path loses what the volume before it takes.
Surface reach(inout Path path, Hit hit) {
    path.width += path.spread * hit.distance;
    path.throughput *= exp(-path.extinction * hit.distance);
    return surfaceAt(hit, path.direction, path.width);
}

// Light that comes along a path from where it meets nothing.
vec3 lightBeyond(Path path) {
    return path.throughput * missedLight(path.direction, path.density);
}

// The share of the light of a surface that shadow rays do not find.
float emissionShare(Path path, Hit hit, Surface surface) {
    if (path.density < 0.0 || frame.emitterCount == 0u) {
        return 1.0;
    }
    float weight = frame.geometries.at[frame.instances.at[hit.instance].firstGeometry + hit.geometry].emissionWeight;
    if (weight > 0.0 && path.density < LEAST_DENSITY) {
        return 0.0;
    }
    vec3 way = surface.position - path.from;
    float density = emitterDensity(weight, length(way), abs(dot(surface.geometricNormal, path.direction)));
    return powerShare(path.density, density);
}

// How a path goes on from a surface.
struct Bounce {
    Bsdf bsdf;
    ShadowRay shadow;
    Scattered scattered;
    float choice; // whether chance ends the path
};

Bounce bounceAt(Path path, Surface surface, Bsdf bsdf, inout Random random) {
    vec2 lightChoices = nextPair(random);
    vec2 lightPlace = nextPair(random);
    ShadowRay shadow = shadowRay(surface, bsdf, path.extinction, lightChoices.x, lightPlace);
    vec2 choices = nextPair(random);
    vec2 u = nextPair(random);
    return Bounce(bsdf, shadow, scatter(surface, bsdf, -path.direction, choices, u), lightChoices.y);
}

// Leads a path on from a surface. False: it ends there.
bool follow(inout Path path, Surface surface, Bounce bounce) {
    Scattered scattered = bounce.scattered;
    // Shadow rays go through panes, but not through what bounds a volume.
    bool isThin = (surface.flags & kThin) != 0u;
    path.density = !scattered.isPane ? scattered.density : isThin ? path.density : -1.0;
    path.from = scattered.isPane ? path.from : surface.position;
    path.extinction = extinctionTowards(surface, scattered.direction, path.extinction);
    if (!isThin && dot(scattered.direction, surface.geometricNormal) < 0.0) {
        path.squeezed *= bounce.bsdf.eta * bounce.bsdf.eta;
    }
    if (path.spread > 0.0 && !scattered.isPane) {
        path.spread = max(path.spread, kConeShare * inversesqrt(max(scattered.density, 1e-6)));
    }
    path.origin = leaveTo(surface, scattered.direction);
    path.direction = scattered.direction;
    float chance = min(largest(path.throughput) * path.squeezed, 1.0);
    bool isSure = path.bounce < kSureBounces;
    chance = isSure ? chance : min(chance, 0.95);
    if (chance <= 0.0 || (!isSure && bounce.choice >= chance)) {
        return false;
    }
    path.throughput = isSure ? path.throughput : path.throughput / chance;
    path.bounce += 1u;
    return path.bounce <= frame.maxBounces;
}

// The share of the light of a shadow ray that nothing takes.
vec3 transmittanceOf(ShadowRay ray, inout Path path) {
    if (!any(greaterThan(ray.light, vec3(0.0)))) {
        return vec3(0.0);
    }
    path.rayCount += 1u;
    return transmittanceTo(ray.origin, ray.direction, ray.range);
}

// The light of a path that has ended.
vec3 radianceOf(Path path) {
    bool isNumber = !any(isnan(path.radiance)) && !any(isinf(path.radiance));
    return isNumber ? path.radiance : vec3(0.0);
}

#endif
