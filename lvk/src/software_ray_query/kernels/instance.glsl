// Instances: records in the caller's buffers, and in the TLAS.
const uint kInstanceBytes = 128u;

// Format of a header that only contains the new address of a moved BLAS.
const uint kMoved = 2u;

struct Affine { vec3 x; vec3 y; vec3 z; vec3 t; };

vec3 apply(Affine m, vec3 p) { return m.x * p.x + m.y * p.y + m.z * p.z + m.t; }

// Returns the largest power of two that is not above a positive number.
float powerBelow(float v) { return uintBitsToFloat(floatBitsToUint(v) & 0x7f800000u); }

// Inverts a matrix by its cofactors, scaled by its largest number. Returns false if it is singular within rounding
// errors. `SINGULAR_EPSILON` in software_ray_query/bvh/encode_instances.rs is the same share.
bool invert(Affine m, out Affine inverse) {
    const float kNothing = 4.76837158e-7;
    vec3 most = max(abs(m.x), max(abs(m.y), abs(m.z)));
    float largest = powerBelow(max(most.x, max(most.y, most.z)));
    inverse = Affine(vec3(0), vec3(0), vec3(0), vec3(0));
    if (!(largest > 0.0)) return false;
    vec3 x = m.x / largest, y = m.y / largest, z = m.z / largest;
    vec3 yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
    float determinant = dot(x, yz);
    float products = dot(abs(x), abs(y.yzx * z.zxy) + abs(y.zxy * z.yzx));
    if (!(abs(determinant) > products * kNothing)) return false;
    float scale = 1.0 / determinant / largest;
    inverse.x = vec3(yz.x, zx.x, xy.x) * scale;
    inverse.y = vec3(yz.y, zx.y, xy.y) * scale;
    inverse.z = vec3(yz.z, zx.z, xy.z) * scale;
    inverse.t = -(inverse.x * m.t.x + inverse.y * m.t.y + inverse.z * m.t.z);
    return isFinite(inverse.x) && isFinite(inverse.y) && isFinite(inverse.z) && isFinite(inverse.t);
}

// Clamps to finite numbers, and replaces NaN (of infinities that met) by `other`.
vec3 numberOr(vec3 v, float other) {
    bvec3 isNone = greaterThan(floatBitsToUint(v) & uvec3(0x7fffffffu), uvec3(0x7f800000u));
    return mix(clamp(v, vec3(-kFar), vec3(kFar)), vec3(other), isNone);
}

// Returns the bounds of a transformed box, with a margin for rounding here and where rays are transformed.
Box moved(Affine m, Box box) {
    const float kRounding = 6e-7;
    const float kRays = 1.0 / 1048576.0;
    vec3 c = centre(box);
    vec3 h = box.hi * 0.5 - box.lo * 0.5;
    vec3 reach = abs(m.x) * h.x + abs(m.y) * h.y + abs(m.z) * h.z;
    vec3 far = abs(m.x) * abs(c.x) + abs(m.y) * abs(c.y) + abs(m.z) * abs(c.z) + abs(m.t);
    vec3 middle = apply(m, c);
    vec3 half_ = reach + (far + reach) * kRounding + (abs(middle) + reach) * kRays;
    return Box(numberOr(middle - half_, -kFar), numberOr(middle + half_, kFar));
}

uvec2 structureOf(uvec2 named) {
    if (job.table == uvec2(0)) return named;
    if (named.y != 0u || named.x >= job.inputCount) return uvec2(0);
    Inputs entry = Inputs(element(job.table, named.x, 8u));
    return uvec2(entry.word[0], entry.word[1]);
}

// Stores an instance and returns its bounds in the world; empty if no ray can hit it.
Box keepInstance(uint i) {
    InputQuads record = InputQuads(element(job.inputs, i, 64u));
    uvec4 a = record.quad[0], b = record.quad[1], c = record.quad[2], numbers = record.quad[3];
    Affine m;
    m.x = uintBitsToFloat(uvec3(a.x, b.x, c.x));
    m.y = uintBitsToFloat(uvec3(a.y, b.y, c.y));
    m.z = uintBitsToFloat(uvec3(a.z, b.z, c.z));
    m.t = uintBitsToFloat(uvec3(a.w, b.w, c.w));
    uvec2 structure = structureOf(numbers.zw);
    Affine inverse;
    bool finite = isFinite(m.x) && isFinite(m.y) && isFinite(m.z) && isFinite(m.t);
    bool isActive = finite && numbers.x >> 24 != 0u && structure != uvec2(0) && invert(m, inverse);
    if (!isActive) return emptyBox();
    uvec4 start = InputQuads(structure).quad[0];
    // An address, because some drivers do not support buffer references that depend on a condition.
    uvec2 shown = start.x == kMoved ? start.zw : structure;
    if (start.x == kMoved) start = InputQuads(shown).quad[0];
    if (start.z == kNone) return emptyBox();
    Quads kept = Quads(element(place(job.primitives), i, kInstanceBytes));
    kept.quad[0] = floatBitsToUint(vec4(inverse.x.x, inverse.y.x, inverse.z.x, inverse.t.x));
    kept.quad[1] = floatBitsToUint(vec4(inverse.x.y, inverse.y.y, inverse.z.y, inverse.t.y));
    kept.quad[2] = floatBitsToUint(vec4(inverse.x.z, inverse.y.z, inverse.z.z, inverse.t.z));
    kept.quad[3] = a;
    kept.quad[4] = b;
    kept.quad[5] = c;
    kept.quad[6] = uvec4(structure, numbers.xy);
    kept.quad[7] = uvec4(i, uvec3(0));
    uvec4 low = InputQuads(shown).quad[3], high = InputQuads(shown).quad[4];
    return moved(m, Box(uintBitsToFloat(low.xyz), uintBitsToFloat(uvec3(low.w, high.xy))));
}
