// The light of what each pixel shows, of one sample: rays for shadows, for one direction that its surface prefers, and along a path
// that goes on from there. Matte layers and all others are kept apart, without their colours, for the filter. The including file
// provides traceNearest() and transmittanceTo().
#ifndef VIEWER_VISIBLE_LIGHT
#define VIEWER_VISIBLE_LIGHT

#include "viewer/path.glsl"
#include "viewer/plane.glsl"
#include "viewer/visible_triangle.glsl"

// A sample that is brighter would leave a bright spot for many frames.
const float kBrightestSample = 12.0;

// Where the ray of a pixel meets the plane of its triangle.
Hit visibleHit(uvec4 visible, vec3 origin, vec3 direction) {
    Instance instance = frame.instances.at[visible.x];
    Geometry geometry = frame.geometries.at[instance.firstGeometry + visible.y];
    uvec3 corners = CornerArray(geometry.indices).at[visible.z];
    vec3 a = toWorld(instance, positionOf(geometry, corners.x));
    vec3 e1 = toWorld(instance, positionOf(geometry, corners.y)) - a;
    vec3 e2 = toWorld(instance, positionOf(geometry, corners.z)) - a;
    vec3 p = cross(direction, e2);
    float determinant = dot(e1, p);
    float inverse = abs(determinant) > 0.0 ? 1.0 / determinant : 0.0;
    vec3 s = origin - a;
    vec3 q = cross(s, e1);
    vec2 barycentrics = clamp(vec2(dot(s, p), dot(direction, q)) * inverse, 0.0, 1.0);
    barycentrics /= max(barycentrics.x + barycentrics.y, 1.0);
    float distance = dot(a + barycentrics.x * e1 + barycentrics.y * e2 - origin, direction);
    return Hit(visible.x, visible.y, visible.z, barycentrics, distance);
}

// Where the surface at `point` was in the frame before.
vec3 pointBefore(Hit hit, vec3 point) {
    Geometry geometry = frame.geometries.at[frame.instances.at[hit.instance].firstGeometry + hit.geometry];
    uvec3 corners = CornerArray(geometry.indices).at[hit.primitive];
    vec3 weights = weightsOf(hit.barycentrics);
    vec3 now = vec3(0.0);
    vec3 before = vec3(0.0);
    for (uint corner = 0u; corner < 3u; ++corner) {
        now += weights[corner] * positionIn(geometry.positions, geometry.flags, corners[corner]);
        before += weights[corner] * positionIn(geometry.positionsBefore, geometry.flags, corners[corner]);
    }
    vec3 way = transformed(frame.rowsBefore.at[hit.instance], before) - transformed(frame.instances.at[hit.instance].rows, now);
    return frame.sceneMoves != 0u ? point + way : point;
}

vec3 clamped(vec3 light) {
    float most = largest(light) * frame.exposure;
    return most > kBrightestSample ? light * (kBrightestSample / most) : light;
}

void storeLight(uint place, Seen seen, vec3 base, vec3 matte, vec3 matteAlbedo, vec3 mirrored, vec3 share) {
    frame.planes.at[currentPlane(kPlaneSurface, place)] = packedSeen(seen);
    frame.planes.at[planePlace(kPlaneBase, place)] = vec4(base, 0.0);
    frame.planes.at[planePlace(kPlaneMatteAlbedo, place)] = vec4(matteAlbedo, 0.0);
    frame.planes.at[planePlace(kPlaneMirroredShare, place)] = vec4(share, 0.0);
    frame.planes.at[planePlace(kPlaneMatte, place)] = vec4(clamped(matte / max(matteAlbedo, 1e-3)), 0.0);
    frame.planes.at[planePlace(kPlaneMirrored, place)] = vec4(clamped(mirrored / max(share, 1e-3)), 0.0);
}

void storePoint(uint place, vec3 point) {
    frame.planes.at[planePlace(kPlaneBefore, place)] = vec4(point, 0.0);
}

void visibleLightPixel(uvec2 pixel) {
    uint place = pixelPlace(ivec2(pixel));
    vec3 direction = cameraDirection(frame.camera, pixel);
    uvec4 visible = visibleTriangle(ivec2(pixel));
    const vec3 none = vec3(0.0);
    if (visible.x == kNothing) {
        storePoint(place, frame.camera.eye + kSkyDistance * frame.camera.nearPlane * direction);
        storeLight(place, Seen(-direction, -1.0, 0xffffffu, 1.0), missedLight(direction, -1.0), none, none, none, none);
        return;
    }
    Hit hit = visibleHit(visible, frame.camera.eye, direction);
    Surface surface = surfaceAt(hit, direction, frame.camera.pixelSpread * hit.distance);
    Seen seen = Seen(surface.normal, hit.distance, hit.instance, surface.roughness);
    storePoint(place, pointBefore(hit, frame.camera.eye + hit.distance * direction));
    if ((surface.flags & kUnlit) != 0u) {
        storeLight(place, seen, surface.baseColor, none, none, none, none);
        return;
    }
    Random random = randomOf(pixel, frame.sampleNumber);
    Bsdf bsdf = bsdfOf(surface, -direction);
    vec2 lightChoices = nextPair(random);
    vec2 lightPlace = nextPair(random);
    DirectLight direct = directLight(surface, bsdf, vec3(0.0), lightChoices.x, lightPlace);
    vec2 choices = nextPair(random);
    vec2 u = nextPair(random);
    Scattered scattered = scatter(surface, bsdf, -direction, choices, u);
    vec3 matte = direct.matte;
    vec3 mirrored = direct.all - direct.matte;
    if (any(greaterThan(scattered.weight, none))) {
        Path path = firstPath(surface.position, direction);
        path.spread = frame.camera.pixelSpread;
        path.width = path.spread * hit.distance;
        follow(path, surface, bsdf, scattered);
        vec3 light = pathRadiance(path, 1u, random);
        matte += scattered.matte * light;
        mirrored += (scattered.weight - scattered.matte) * light;
    }
    bool isClear = bsdf.lobes[kGlassLobe] + bsdf.lobes[kPaneLobe] > 0.0;
    vec3 share = isClear ? vec3(1.0) : bsdf.reflected;
    seen.roughness = surface.coat > 0.0 ? min(surface.roughness, surface.coatRoughness) : surface.roughness;
    storeLight(place, seen, surface.emission, matte, bsdf.diffuse + bsdf.sheen, mirrored, share);
}

#endif
