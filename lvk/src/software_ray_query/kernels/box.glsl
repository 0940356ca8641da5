// AABBs, and bounds that many invocations extend.
struct Box { vec3 lo; vec3 hi; };

const float kFar = 3.402823466e38;

Box emptyBox() { return Box(vec3(kFar), vec3(-kFar)); }

bool isEmpty(Box box) { return box.lo.x > box.hi.x; }

// Clamps like builds on the CPU (MAX_COORDINATE in software_ray_query/bvh/primitives.rs): sides and areas stay finite.
vec3 ended(vec3 v) {
    const float kFarthest = 1e15;
    return clamp(v, vec3(-kFarthest), vec3(kFarthest));
}

Box around(vec3 a, vec3 b, vec3 c) { return Box(ended(min(a, min(b, c))), ended(max(a, max(b, c)))); }

Box join(Box a, Box b) { return Box(min(a.lo, b.lo), max(a.hi, b.hi)); }

// Tests bits: compilers may assume that no float is infinite or NaN.
bool isFinite(vec3 v) {
    return all(notEqual(floatBitsToUint(v) & uvec3(0x7f800000u), uvec3(0x7f800000u)));
}

bool isNumber(vec3 v) {
    return all(lessThanEqual(floatBitsToUint(v) & uvec3(0x7fffffffu), uvec3(0x7f800000u)));
}

float areaOf(Box box) {
    vec3 side = max(box.hi - box.lo, vec3(0));
    return side.x * side.y + side.y * side.z + side.z * side.x;
}

vec3 centre(Box box) { return box.lo * 0.5 + box.hi * 0.5; }

// Maps floats to integers of the same order.
uvec3 ordered(vec3 v) {
    uvec3 bits = floatBitsToUint(v);
    return mix(bits | 0x80000000u, ~bits, notEqual(bits & 0x80000000u, uvec3(0)));
}

vec3 unordered(uvec3 v) {
    return uintBitsToFloat(mix(~v, v & 0x7fffffffu, notEqual(v & 0x80000000u, uvec3(0))));
}

Box readBox(Corners from, uint i) { return Box(from.corner[2 * i], from.corner[2 * i + 1]); }

void writeBox(Corners to, uint i, Box box) {
    to.corner[2 * i] = box.lo;
    to.corner[2 * i + 1] = box.hi;
}
