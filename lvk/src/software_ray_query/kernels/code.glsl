// Codes of positions along a space-filling curve (Morton order), of 30 to 60 bits.
uint spread(uint v) {
    v = (v | v << 16) & 0x030000ffu;
    v = (v | v << 8) & 0x0300f00fu;
    v = (v | v << 4) & 0x030c30c3u;
    return (v | v << 2) & 0x09249249u;
}

uint interleave(uvec3 v) { return spread(v.x) << 2 | spread(v.y) << 1 | spread(v.z); }

// Returns the code of the box's centre in the bounds of all centres, with cubic cells. High word, low word.
uvec2 codeOf(Box box) {
    Quads all_ = Quads(job.scratch);
    uvec4 first = all_.quad[0], second = all_.quad[1];
    vec3 lo = unordered(~first.xyz);
    vec3 hi = unordered(uvec3(first.w, second.xy));
    vec3 extent = hi * 0.5 - lo * 0.5;
    float largest = max(extent.x, max(extent.y, extent.z));
    vec3 unit = largest > 0.0 ? (centre(box) * 0.5 - lo * 0.5) / largest : vec3(0);
    float cells = job.lowBits != 0u ? 1048576.0 : 1024.0;
    uvec3 cell = uvec3(clamp(unit * cells, vec3(0), vec3(cells - 1.0)));
    if (job.lowBits == 0u) return uvec2(interleave(cell), 0);
    return uvec2(interleave(cell >> 10), interleave(cell & 1023u) >> 30u - job.lowBits);
}

// Writes the key of primitive `i`, and resets the arrivals behind leaf `i`. Inactive primitives sort after all others.
void writeKey(uint i) {
    Box box = readBox(Corners(work(job.boxes)), i);
    uvec2 code = isEmpty(box) ? uvec2(kNone) : codeOf(box);
    Words keys = keysBefore(0u);
    keys.word[i] = code.x;
    keys.word[job.count + i] = i;
    if (job.lowBits != 0u) keys.word[2 * job.count + i] = code.y;
    if (i + 1u < job.count) Words(work(job.arrivals)).word[i] = kNone;
}
