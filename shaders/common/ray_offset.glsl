// Origin of a ray that leaves a surface, offset so that it does not meet the same surface again.
#ifndef COMMON_RAY_OFFSET
#define COMMON_RAY_OFFSET

// A hit point is known to a few units in the last place of its largest coordinate; near the origin the
// vertices' own coordinates count, for which `smallestExtent` (in the scene's unit) stands in.
const float kOffsetPerUnit = 1.0 / 65536.0;

vec3 leaveSurface(vec3 position, vec3 geometricNormal, float smallestExtent) {
    vec3 magnitude = abs(position);
    float extent = max(max(magnitude.x, magnitude.y), max(magnitude.z, smallestExtent));
    return position + geometricNormal * (extent * kOffsetPerUnit);
}

#endif
