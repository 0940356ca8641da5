// Triangles and AABBs in the caller's buffers.
struct Geometry {
    uvec2 data;          // positions or AABBs
    uvec2 indices;
    uvec2 matrix;        // 0 without a matrix
    uint stride;
    uint format;
    uint indexBytes;     // 0, 2 or 4
    uint vertexCount;
    uint firstPrimitive; // among all primitives
    uint firstVertex;    // among all vertices
    uint flags;
    uint reserved0;
    uint reserved1;
    uint reserved2;
};

const uint kGeometryBytes = 64u;
// Word indices of these fields.
const uint kFirstPrimitive = 10u;
const uint kFirstVertex = 11u;

Geometry readGeometry(uint number) {
    InputQuads from = InputQuads(element(job.inputs, number, kGeometryBytes));
    uvec4 a = from.quad[0], b = from.quad[1], c = from.quad[2], d = from.quad[3];
    return Geometry(a.xy, a.zw, b.xy, b.z, b.w, c.x, c.y, c.z, c.w, d.x, d.y, d.z, d.w);
}

// Returns four bytes from any address; reads only words that contain one of them.
uint wordAt(uvec2 address) {
    Inputs at = Inputs(uvec2(address.x & ~3u, address.y));
    uint shift = (address.x & 3u) * 8u;
    uint low = at.word[0];
    return shift == 0u ? low : low >> shift | at.word[1] << (32u - shift);
}

uint halfAt(uvec2 address) {
    uint word = Inputs(uvec2(address.x & ~3u, address.y)).word[0];
    return (address.x & 2u) == 0u ? word & 0xffffu : word >> 16;
}

// Positions of 32-bit numbers are aligned to four bytes.
vec3 widePosition(uvec2 at, uint format) {
    if (format == 2u || format == 3u) return uintBitsToFloat(InputTriples(at).triple[0]);
    Inputs words = Inputs(at);
    uint x = words.word[0];
    if (format == 9u) return vec3(float(x), 0.0, 0.0);
    return vec3(uintBitsToFloat(x), format == 1u ? uintBitsToFloat(words.word[1]) : 0.0, 0.0);
}

vec3 narrowPosition(uvec2 at, uint format) {
    uint low = wordAt(at);
    uint high = format == 5u || format == 7u ? halfAt(plus(at, 4u, 0u)) : 0u;
    if (format < 6u) return vec3(unpackHalf2x16(low), unpackHalf2x16(high).x);
    if (format < 8u) return vec3(unpackSnorm2x16(low), unpackSnorm2x16(high).x);
    return unpackUnorm4x8(low).xyz;
}

vec3 positionOf(Geometry g, uint vertex) {
    uvec2 at = element(g.data, vertex, g.stride);
    vec3 p = g.format < 4u || g.format > 8u ? widePosition(at, g.format) : narrowPosition(at, g.format);
    if (g.matrix == uvec2(0)) return p;
    InputQuads rows = InputQuads(g.matrix);
    mat3x4 m = mat3x4(uintBitsToFloat(rows.quad[0]), uintBitsToFloat(rows.quad[1]), uintBitsToFloat(rows.quad[2]));
    return vec4(p, 1.0) * m;
}

uvec3 cornersOf(Geometry g, uint primitive) {
    if (g.indexBytes == 0u) return uvec3(0, 1, 2) + primitive * 3u;
    uvec2 at = element(g.indices, primitive, g.indexBytes * 3u);
    if (g.indexBytes == 2u) return uvec3(halfAt(at), halfAt(plus(at, 2u, 0u)), halfAt(plus(at, 4u, 0u)));
    return InputTriples(at).triple[0];
}

// A triangle, or minimum and maximum of an AABB. Inactive if a coordinate is NaN, or an index exceeds the vertex count.
struct Primitive {
    bool isActive;
    uvec3 corner;
    vec3 a;
    vec3 b;
    vec3 c;
};

Primitive readTriangle(Geometry g, uint index) {
    Primitive found;
    found.corner = cornersOf(g, index);
    found.isActive = all(lessThan(found.corner, uvec3(g.vertexCount)));
    mat3 corners = mat3(0.0);
    if (found.isActive) {
        [[dont_unroll]] for (uint k = 0; k < 3; ++k) {
            corners[k] = positionOf(g, found.corner[k]);
            found.isActive = found.isActive && isFinite(corners[k]);
        }
    }
    found.a = corners[0];
    found.b = corners[1];
    found.c = corners[2];
    return found;
}

Primitive readBoxInput(Geometry g, uint index) {
    uvec2 at = element(g.data, index, g.stride);
    Primitive found;
    found.corner = uvec3(0);
    InputTriples corners = InputTriples(at);
    found.a = uintBitsToFloat(corners.triple[0]);
    found.b = uintBitsToFloat(corners.triple[1]);
    found.c = vec3(0);
    found.isActive = isNumber(found.a) && isNumber(found.b) && all(lessThanEqual(found.a, found.b));
    found.a = ended(found.a);
    found.b = ended(found.b);
    return found;
}

Primitive readPrimitive(Geometry g, uint index) {
    return job.leafKind == kBoxes ? readBoxInput(g, index) : readTriangle(g, index);
}

Box boxOf(Primitive found) {
    if (!found.isActive) return emptyBox();
    if (job.leafKind == kBoxes) return Box(found.a, found.b);
    return around(found.a, found.b, found.c);
}

// Returns the last geometry that starts at or before index `i`, counted in primitives or vertices.
uint geometryOf(uint i, bool vertices) {
    uint word = vertices ? kFirstVertex : kFirstPrimitive;
    uint low = 0, high = job.inputCount;
    [[dont_unroll]] while (high - low > 1) {
        uint middle = (low + high) / 2;
        if (Inputs(element(job.inputs, middle, kGeometryBytes)).word[word] <= i) low = middle; else high = middle;
    }
    return low;
}

Box inputBox(uint i) {
    Geometry g = readGeometry(geometryOf(i, false));
    return boxOf(readPrimitive(g, i - g.firstPrimitive));
}
