// Visibility of the lamp from a position, by the cube map of depths.
#ifndef OMNI_SHADOWS_SHADOW
#define OMNI_SHADOWS_SHADOW

#include "omni_shadows/frame.glsl"

const uint kSearches = 12u;
const uint kTaps = 32u;
// Nothing that throws shadows is closer to the lamp.
const float kNearestBlocker = 0.3;

float longest(vec3 v) {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

// Evenly spread over a disc of radius 1.
vec2 onDisc(uint number, uint count, float turn) {
    float angle = float(number) * 2.3999632 + turn;
    return sqrt((float(number) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}

// Different for neighbouring pixels, 0 to 1.
float pixelNoise() {
    return fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
}

// A surface, seen from the lamp.
struct Receiver {
    vec3 direction; // of unit length
    vec3 across; // two at right angles to it
    vec3 along;
    vec3 normal; // on the lamp's side
    float planeDistance; // of the lamp from the surface's plane, below 0
    float distance;
};

Receiver receiverAt(vec3 position, vec3 normal) {
    Receiver receiver;
    vec3 way = position - frame.light;
    // Above the surface by as much as a texel hides of a slope.
    way += 1.5 * frame.texel * longest(way) * normal;
    receiver.distance = length(way);
    receiver.direction = way / receiver.distance;
    vec3 other = abs(receiver.direction.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
    receiver.across = normalize(cross(other, receiver.direction));
    receiver.along = cross(receiver.direction, receiver.across);
    receiver.normal = normal;
    receiver.planeDistance = dot(way, normal);
    return receiver;
}

// Distance, along the axis of the face that `direction` meets, at which it meets the surface's plane.
float faceDistance(Receiver receiver, vec3 direction) {
    float reached = receiver.planeDistance / min(dot(direction, receiver.normal), -1e-4);
    return longest(direction) * clamp(reached, 0.7 * receiver.distance, 1.4 * receiver.distance);
}

vec3 beside(Receiver receiver, vec2 offset) {
    return receiver.direction + offset.x * receiver.across + offset.y * receiver.along;
}

float compareAlong(uint smp, vec3 direction, float distance) {
    return textureBindlessCubeShadow(frame.cube, smp, vec4(direction, frame.lampNear / distance));
}

// Mean distance of what lies before the surface, as part of the surface's; 1 where nothing does.
float blockerPart(Receiver receiver, float radius, float turn) {
    float sum = 0.0;
    float count = 0.0;
    for (uint i = 0u; i < kSearches; ++i) {
        vec3 direction = beside(receiver, radius * onDisc(i, kSearches, turn));
        float part = frame.lampNear / textureBindlessCubeLod(frame.cube, frame.reading, direction, 0.0).r /
                     faceDistance(receiver, direction);
        if (part < 1.0) {
            sum += part;
            count += 1.0;
        }
    }
    return count > 0.0 ? sum / count : 1.0;
}

// Angle under which the edge of something at `part` of the distance is blurred, for a lamp of that radius.
float penumbra(float part, float distance) {
    return frame.bulb * (1.0 - part) / (part * distance);
}

float softVisibility(Receiver receiver) {
    float turn = 6.2831853 * pixelNoise();
    float widest = penumbra(clamp(kNearestBlocker / receiver.distance, 0.05, 1.0), receiver.distance);
    float part = blockerPart(receiver, widest + frame.texel, turn);
    if (part >= 1.0) {
        return 1.0;
    }
    float radius = max(penumbra(part, receiver.distance), 0.75 * frame.texel);
    float sum = 0.0;
    for (uint i = 0u; i < kTaps; ++i) {
        vec3 direction = beside(receiver, radius * onDisc(i, kTaps, turn));
        sum += compareAlong(frame.linearComparing, direction, faceDistance(receiver, direction));
    }
    return sum / float(kTaps);
}

// `normal` is on the lamp's side.
float visibility(vec3 position, vec3 normal) {
    if (frame.filtering == kUnshadowed) {
        return 1.0;
    }
    Receiver receiver = receiverAt(position, normal);
    if (frame.filtering == kSoft) {
        return softVisibility(receiver);
    }
    uint smp = frame.filtering == kHard ? frame.nearestComparing : frame.linearComparing;
    return compareAlong(smp, receiver.direction, faceDistance(receiver, receiver.direction));
}

#endif
