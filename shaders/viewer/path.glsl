// The light of a pixel by paths from the camera. At each surface a shadow ray looks for light, and the path goes on in a direction
// that the surface prefers; light that both can find is shared between them. The including file provides traceNearest() and
// transmittanceTo().
#ifndef VIEWER_PATH
#define VIEWER_PATH

#include "common/ray_offset.glsl"
#include "viewer/lights.glsl"

// Surfaces of a path before chance may end it.
const uint kSureBounces = 3u;
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

// The share of arriving light that nothing takes on its way. The ray does not begin on the surface but a little above it, so it is aimed
// anew: along the direction from the surface, it would meet a light that stands low over the surface before its range ends.
vec3 transmittanceOfLight(Surface surface, Arriving arriving) {
    vec3 origin = leaveTo(surface, arriving.direction);
    if (arriving.distance >= kFar) {
        return transmittanceTo(origin, arriving.direction, kFar);
    }
    vec3 way = surface.position + arriving.distance * arriving.direction - origin;
    float distance = max(length(way), 1e-6);
    return transmittanceTo(origin, way / distance, 0.9999 * distance);
}

// Light at a surface from one light or from the sky, drawn by chance: all of it, and what the matte layer scatters.
struct DirectLight {
    vec3 all;
    vec3 matte;
};

// `extinction`: of the volume that the path came through.
DirectLight directLight(Surface surface, Bsdf bsdf, vec3 extinction, float choice, vec2 u) {
    Arriving arriving = drawLight(surface.position, choice, u);
    Response response = respond(surface, bsdf, arriving.direction);
    if (!any(greaterThan(response.value * arriving.radiance, vec3(0.0)))) {
        return DirectLight(vec3(0.0), vec3(0.0));
    }
    vec3 way = transmittanceOfLight(surface, arriving);
    if (arriving.distance < kFar) {
        way *= exp(-extinctionTowards(surface, arriving.direction, extinction) * arriving.distance);
    }
    float share = arriving.density > 0.0 ? powerShare(arriving.density, response.density) : 1.0;
    vec3 light = share * way * arriving.radiance;
    return DirectLight(light * response.value, light * response.matte);
}

// A path under way.
struct Path {
    vec3 origin;
    vec3 direction;
    float density; // of the direction; below 0 where nothing else looks for light along it
    vec3 from; // the surface that the direction was drawn at
    vec3 extinction; // of the volume that the path is in
    float squeezed; // radiance is eta^2 as much inside of a volume, which comes back at its end
    float spread; // of the cone that the path stands for, over its length; 0: textures are read unfiltered
    float width; // of the cone at the origin
};

Path firstPath(vec3 origin, vec3 direction) {
    return Path(origin, direction, -1.0, origin, vec3(0.0), 1.0, 0.0, 0.0);
}

// Goes on from a surface.
void follow(inout Path path, Surface surface, Bsdf bsdf, Scattered scattered) {
    // Shadow rays go through panes, but not through what bounds a volume.
    bool isThin = (surface.flags & kThin) != 0u;
    path.density = !scattered.isPane ? scattered.density : isThin ? path.density : -1.0;
    path.from = scattered.isPane ? path.from : surface.position;
    path.extinction = extinctionTowards(surface, scattered.direction, path.extinction);
    if (!isThin && dot(scattered.direction, surface.geometricNormal) < 0.0) {
        path.squeezed *= bsdf.eta * bsdf.eta;
    }
    if (path.spread > 0.0 && !scattered.isPane) {
        path.spread = max(path.spread, kConeShare * inversesqrt(max(scattered.density, 1e-6)));
    }
    path.origin = leaveTo(surface, scattered.direction);
    path.direction = scattered.direction;
}

// The share of the light of a surface that shadow rays do not find.
float emissionShare(Path path, Hit hit, Surface surface) {
    if (path.density < 0.0 || frame.emitterCount == 0u) {
        return 1.0;
    }
    float weight = frame.geometries.at[frame.instances.at[hit.instance].firstGeometry + hit.geometry].emissionWeight;
    vec3 way = surface.position - path.from;
    float density = emitterDensity(weight, length(way), abs(dot(surface.geometricNormal, path.direction)));
    return powerShare(path.density, density);
}

// Light that comes against the direction of a path whose next surface has the number `bounce`.
vec3 pathRadiance(Path path, uint bounce, inout Random random) {
    vec3 radiance = vec3(0.0);
    vec3 throughput = vec3(1.0);
    for (; bounce <= frame.maxBounces; ++bounce) {
        Hit hit = traceNearest(path.origin, path.direction, hashWords(random.seed + bounce, random.number));
        if (hit.instance == kNothing) {
            radiance += throughput * missedLight(path.direction, path.density);
            break;
        }
        path.width += path.spread * hit.distance;
        Surface surface = surfaceAt(hit, path.direction, path.width);
        throughput *= exp(-path.extinction * hit.distance);
        if ((surface.flags & kUnlit) != 0u) {
            radiance += throughput * surface.baseColor;
            break;
        }
        radiance += throughput * emissionShare(path, hit, surface) * surface.emission;
        Bsdf bsdf = bsdfOf(surface, -path.direction);
        vec2 lightChoices = nextPair(random);
        vec2 lightPlace = nextPair(random);
        radiance += throughput * directLight(surface, bsdf, path.extinction, lightChoices.x, lightPlace).all;
        vec2 choices = nextPair(random);
        vec2 u = nextPair(random);
        Scattered scattered = scatter(surface, bsdf, -path.direction, choices, u);
        throughput *= scattered.weight;
        follow(path, surface, bsdf, scattered);
        float chance = min(largest(throughput) * path.squeezed, 1.0);
        if (bounce >= kSureBounces) {
            chance = min(chance, 0.95);
            if (lightChoices.y >= chance) {
                break;
            }
            throughput /= chance;
        } else if (chance <= 0.0) {
            break;
        }
    }
    bool isNumber = !any(isnan(radiance)) && !any(isinf(radiance));
    return isNumber ? radiance : vec3(0.0);
}

// Samples of a pixel are spread over all of it.
vec3 sampleRadiance(uvec2 pixel, uint number) {
    Random random = randomOf(pixel, number);
    vec2 ndc = (vec2(pixel) + nextPair(random)) / vec2(frame.camera.width, frame.camera.height) * 2.0 - 1.0;
    vec3 direction = normalize(frame.camera.forward + ndc.x * frame.camera.right + ndc.y * frame.camera.down);
    return pathRadiance(firstPath(frame.camera.eye, direction), 0u, random);
}

void pathPixel(uvec2 pixel) {
    uint place = pixel.y * frame.camera.width + pixel.x;
    vec3 sum = frame.sampleNumber == 0u ? vec3(0.0) : frame.sums.at[place].rgb;
    for (uint i = 0u; i < frame.sampleCount; ++i) {
        sum += sampleRadiance(pixel, frame.sampleNumber + i);
    }
    frame.sums.at[place] = vec4(sum, float(frame.sampleNumber + frame.sampleCount));
}

#endif
