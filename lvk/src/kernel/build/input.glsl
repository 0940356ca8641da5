// Triangles and boxes as the caller's buffers hold them.
struct Geometry {
    uvec2 data;          // positions or boxes
    uvec2 indices;
    uvec2 matrix;        // 0 if there is none
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

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Geometries { Geometry geometry[]; };

// Four bytes from any address; reads no word that has none of them.
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

vec3 positionAt(uvec2 at, uint format) {
    uint x = wordAt(at);
    switch (format) {
        case 0u: return vec3(uintBitsToFloat(x), 0.0, 0.0);
        case 1u: return vec3(uintBitsToFloat(uvec2(x, wordAt(plus(at, 4u, 0u)))), 0.0);
        case 2u:
        case 3u: return uintBitsToFloat(uvec3(x, wordAt(plus(at, 4u, 0u)), wordAt(plus(at, 8u, 0u))));
        case 4u: return vec3(unpackHalf2x16(x), 0.0);
        case 5u: return vec3(unpackHalf2x16(x), unpackHalf2x16(halfAt(plus(at, 4u, 0u))).x);
        case 6u: return vec3(unpackSnorm2x16(x), 0.0);
        case 7u: return vec3(unpackSnorm2x16(x), unpackSnorm2x16(halfAt(plus(at, 4u, 0u))).x);
        case 8u: return unpackUnorm4x8(x).xyz;
        default: return vec3(float(x), 0.0, 0.0);
    }
}

vec3 positionOf(Geometry g, uint vertex) {
    vec3 p = positionAt(element(g.data, vertex, g.stride), g.format);
    if (g.matrix == uvec2(0)) return p;
    Inputs rows = Inputs(g.matrix);
    vec3 moved;
    [[dont_unroll]] for (uint row = 0; row < 3; ++row) {
        vec4 r = uintBitsToFloat(uvec4(rows.word[row * 4], rows.word[row * 4 + 1], rows.word[row * 4 + 2],
                                       rows.word[row * 4 + 3]));
        moved[row] = dot(r.xyz, p) + r.w;
    }
    return moved;
}

uvec3 cornersOf(Geometry g, uint primitive) {
    if (g.indexBytes == 0u) return uvec3(0, 1, 2) + primitive * 3u;
    uvec2 at = element(g.indices, primitive, g.indexBytes * 3u);
    if (g.indexBytes == 2u) return uvec3(halfAt(at), halfAt(plus(at, 2u, 0u)), halfAt(plus(at, 4u, 0u)));
    Inputs three = Inputs(at);
    return uvec3(three.word[0], three.word[1], three.word[2]);
}

// A triangle, or the two corners of a box. Inactive where a number is none, or an index beyond the vertices.
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
    found.a = positionAt(at, 2u);
    found.b = positionAt(plus(at, 12u, 0u), 2u);
    found.c = vec3(0);
    found.isActive = isNumber(found.a) && isNumber(found.b) && all(lessThanEqual(found.a, found.b));
    found.a = clamp(found.a, vec3(-kFar), vec3(kFar));
    found.b = clamp(found.b, vec3(-kFar), vec3(kFar));
    return found;
}

Primitive readPrimitive(Geometry g, uint index) {
    return job.leafKind == kBoxes ? readBoxInput(g, index) : readTriangle(g, index);
}

Box boxOf(Primitive found) {
    if (!found.isActive) return emptyBox();
    if (job.leafKind == kBoxes) return Box(found.a, found.b);
    return Box(min(found.a, min(found.b, found.c)), max(found.a, max(found.b, found.c)));
}

// The last geometry that starts at or before number `i`, counted in primitives or vertices.
uint geometryOf(uint i, bool vertices) {
    Geometries list = Geometries(job.inputs);
    uint low = 0, high = job.inputCount;
    [[dont_unroll]] while (high - low > 1) {
        uint middle = (low + high) / 2;
        uint first = vertices ? list.geometry[middle].firstVertex : list.geometry[middle].firstPrimitive;
        if (first <= i) low = middle; else high = middle;
    }
    return low;
}

Box inputBox(uint i) {
    Geometry g = Geometries(job.inputs).geometry[geometryOf(i, false)];
    return boxOf(readPrimitive(g, i - g.firstPrimitive));
}
