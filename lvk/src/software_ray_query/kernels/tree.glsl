// The hierarchy of sorted codes: Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees",
// HPG 2012. Every node finds its range independently; leaves with equal codes differ by their indices.
uint leafReference(uint leaf) { return kLeaf | Words(work(job.keys)).word[job.count + leaf]; }

// Returns the leading bits that leaf `i`, whose key is `own`, shares with leaf `j`; -1 if leaf `j` does not exist.
int sameBits(uint i, uvec2 own, int j, uint leaves) {
    if (j < 0 || j >= int(leaves)) return -1;
    Words keys = Words(work(job.keys));
    uint at = uint(j);
    uint other = keys.word[at];
    if (own.x != other) return 31 - findMSB(own.x ^ other);
    if (job.lowBits != 0u) {
        uint low = keys.word[2 * job.count + at];
        if (own.y != low) return 63 - findMSB(own.y ^ low);
    }
    return 95 - findMSB(i ^ uint(j));
}

void writeNode(uint i, uint leaves) {
    Words keys = Words(work(job.keys));
    uvec2 own = uvec2(keys.word[i], job.lowBits != 0u ? keys.word[2 * job.count + i] : 0u);
    int n = int(i);
    int direction = sameBits(i, own, n + 1, leaves) > sameBits(i, own, n - 1, leaves) ? 1 : -1;
    int least = sameBits(i, own, n - direction, leaves);
    int most = 2;
    [[dont_unroll]] while (sameBits(i, own, n + most * direction, leaves) > least) most *= 2;
    int reach = 0;
    [[dont_unroll]] for (int jump = most / 2; jump >= 1; jump /= 2) {
        if (sameBits(i, own, n + (reach + jump) * direction, leaves) > least) reach += jump;
    }
    int last = n + reach * direction;
    int shared_ = sameBits(i, own, last, leaves);
    int split = 0;
    [[dont_unroll]] for (int jump = reach; jump > 1;) {
        jump = (jump + 1) / 2;
        if (sameBits(i, own, n + (split + jump) * direction, leaves) > shared_) split += jump;
    }
    int left = n + split * direction + min(direction, 0);
    bool leftLeaf = min(n, last) == left;
    bool rightLeaf = max(n, last) == left + 1;
    Quads node = Quads(element(job.binary, i, 64u));
    node.quad[0] = uvec4(uvec3(0), leftLeaf ? leafReference(uint(left)) : uint(left));
    node.quad[1] = uvec4(uvec3(0), rightLeaf ? leafReference(uint(left + 1)) : uint(left + 1));
    writeArrivals(i, leftLeaf && rightLeaf);
    if (!leftLeaf) writeParent(uint(left), i, 0u);
    if (!rightLeaf) writeParent(uint(left + 1), i, 1u);
    if (i == 0u) Words(job.parents).word[0] = kNone;
}

void writeHeader(uint leaves) {
    Quads to = Quads(job.blob);
    uint root = leaves == 0u ? kNone : leaves == 1u ? leafReference(0u) : 0u;
    uint geometries = job.leafKind == kInstances ? 0u : job.inputCount;
    to.quad[0] = uvec4(kBinary, job.leafKind, root, state().word[kActive]);
    to.quad[1] = uvec4(job.nodes, job.primitives, job.vertices, job.geometries);
    to.quad[2] = uvec4(leaves == 0u ? 0u : leaves - 1, geometries, 0u, job.headerFlags);
    for (uint k = 3; k < 8; ++k) to.quad[k] = uvec4(0);
}

// Starts the wide nodes with the root. The first word of each is the binary node that it is built from.
void writeWideRoot(uint leaves) {
    const uint kOneLeaf = 3u;
    if (job.wideCapacity == 0u || leaves <= kOneLeaf) return;
    Words(place(job.nodes)).word[0] = 0u;
    state().word[kWideNodes] = 1u;
    state().word[kEnds] = 1u;
}

// Writes the hierarchy, and a header for it. Leaves are single primitives, by their indices.
void writeHierarchy(uint i) {
    uint leaves = state().word[kActive];
    if (i + 1 < leaves) writeNode(i, leaves);
    if (i == 0u) {
        writeHeader(leaves);
        writeWideRoot(leaves);
    }
}
