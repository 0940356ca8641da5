// Instances: records as the caller's buffers hold them, and as the structure keeps them.
const uint kRecordWords = 16u;
const uint kInstanceWords = 32u;

// A header that only says where the structure lies now.
const uint kMoved = 2u;

struct Affine { vec3 x; vec3 y; vec3 z; vec3 t; };

vec3 apply(Affine m, vec3 p) { return m.x * p.x + m.y * p.y + m.z * p.z + m.t; }

// The inverse, by cofactors of the matrix over its largest number; false where there is none.
bool invert(Affine m, out Affine inverse) {
    vec3 most = max(abs(m.x), max(abs(m.y), abs(m.z)));
    float largest = max(most.x, max(most.y, most.z));
    inverse = Affine(vec3(0), vec3(0), vec3(0), vec3(0));
    if (!(largest > 0.0)) return false;
    vec3 x = m.x / largest, y = m.y / largest, z = m.z / largest;
    vec3 yz = cross(y, z), zx = cross(z, x), xy = cross(x, y);
    float determinant = dot(x, yz);
    if (determinant == 0.0) return false;
    float scale = 1.0 / determinant / largest;
    inverse.x = vec3(yz.x, zx.x, xy.x) * scale;
    inverse.y = vec3(yz.y, zx.y, xy.y) * scale;
    inverse.z = vec3(yz.z, zx.z, xy.z) * scale;
    inverse.t = -(inverse.x * m.t.x + inverse.y * m.t.y + inverse.z * m.t.z);
    return isFinite(inverse.x) && isFinite(inverse.y) && isFinite(inverse.z) && isFinite(inverse.t);
}

// Around the box as a matrix moves it, with what rounding may take away, here and where rays are moved.
Box moved(Affine m, Box box) {
    const float kRounding = 6e-7;
    const float kRays = 1.0 / 1048576.0;
    vec3 c = centre(box);
    vec3 h = box.hi * 0.5 - box.lo * 0.5;
    vec3 reach = abs(m.x) * h.x + abs(m.y) * h.y + abs(m.z) * h.z;
    vec3 far = abs(m.x) * abs(c.x) + abs(m.y) * abs(c.y) + abs(m.z) * abs(c.z) + abs(m.t);
    vec3 middle = apply(m, c);
    vec3 half_ = reach + (far + reach) * kRounding + (abs(middle) + reach) * kRays;
    return Box(clamp(middle - half_, vec3(-kFar), vec3(kFar)), clamp(middle + half_, vec3(-kFar), vec3(kFar)));
}

uvec2 structureOf(Inputs record) {
    uvec2 named = uvec2(record.word[14], record.word[15]);
    if (job.table == uvec2(0)) return named;
    if (named.y != 0u || named.x >= job.inputCount) return uvec2(0);
    Inputs entry = Inputs(element(job.table, named.x, 8u));
    return uvec2(entry.word[0], entry.word[1]);
}

void writeRows(Floats to, uint at, Affine m) {
    [[dont_unroll]] for (uint row = 0; row < 3; ++row) {
        to.value[at + row * 4] = m.x[row];
        to.value[at + row * 4 + 1] = m.y[row];
        to.value[at + row * 4 + 2] = m.z[row];
        to.value[at + row * 4 + 3] = m.t[row];
    }
}

// Keeps an instance and answers its box in the world; empty where no ray can meet it.
Box keepInstance(uint i) {
    Inputs record = Inputs(element(job.inputs, i, kRecordWords * 4u));
    Affine m;
    [[dont_unroll]] for (uint row = 0; row < 3; ++row) {
        m.x[row] = uintBitsToFloat(record.word[row * 4]);
        m.y[row] = uintBitsToFloat(record.word[row * 4 + 1]);
        m.z[row] = uintBitsToFloat(record.word[row * 4 + 2]);
        m.t[row] = uintBitsToFloat(record.word[row * 4 + 3]);
    }
    uvec2 structure = structureOf(record);
    Affine inverse;
    bool finite = isFinite(m.x) && isFinite(m.y) && isFinite(m.z) && isFinite(m.t);
    bool isActive = finite && record.word[12] >> 24 != 0u && structure != uvec2(0) && invert(m, inverse);
    if (!isActive) return emptyBox();
    Inputs shown = Inputs(structure);
    if (shown.word[0] == kMoved) shown = Inputs(uvec2(shown.word[2], shown.word[3]));
    if (shown.word[2] == kNone) return emptyBox();
    Words kept = Words(plus(place(job.primitives), i * kInstanceWords << 2, i >> 25));
    Floats numbers = Floats(plus(place(job.primitives), i * kInstanceWords << 2, i >> 25));
    writeRows(numbers, 0, inverse);
    writeRows(numbers, 12, m);
    kept.word[24] = structure.x;
    kept.word[25] = structure.y;
    kept.word[26] = record.word[12];
    kept.word[27] = record.word[13];
    kept.word[28] = i;
    [[dont_unroll]] for (uint k = 29; k < kInstanceWords; ++k) kept.word[k] = 0u;
    vec3 lo = uintBitsToFloat(uvec3(shown.word[12], shown.word[13], shown.word[14]));
    vec3 hi = uintBitsToFloat(uvec3(shown.word[15], shown.word[16], shown.word[17]));
    return moved(m, Box(lo, hi));
}
