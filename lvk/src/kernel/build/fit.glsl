// Fits the boxes of binary nodes, bottom up. A node's own invocation starts where both children are leaves; above, the
// child that arrives last goes on, so that nobody ever waits.
Words nodeAt(uint node) { return Words(plus(place(job.nodes), node << 6, node >> 26)); }

// A child's box and the nodes on the longest path below it.
struct Fitted { Box box; uint height; };

void writeChild(uint node, uint which, Fitted child) {
    Floats to = Floats(plus(place(job.nodes), node << 6, node >> 26));
    writeVec3(to, which * 8, child.box.lo);
    writeVec3(to, which * 8 + 4, child.box.hi);
    nodeAt(node).word[11 + which * 4] = child.height;
}

Fitted readChild(uint node, uint which) {
    Floats from = Floats(plus(place(job.nodes), node << 6, node >> 26));
    return Fitted(Box(readVec3(from, which * 8), readVec3(from, which * 8 + 4)), nodeAt(node).word[11 + which * 4]);
}

bool isLeaf(uint reference) { return (reference & kLeaf) != 0u; }

Fitted fitLeaf(uint node, uint which, uint reference) {
    Fitted fitted = Fitted(leafBox(reference), 0u);
    writeChild(node, which, fitted);
    return fitted;
}

void finish(Fitted root) {
    Floats to = Floats(job.blob);
    writeVec3(to, 12, root.box.lo);
    writeVec3(to, 15, root.box.hi);
    header().word[18] = root.height;
}

// Fits what can be fitted from node `i` up to the root.
void fitFrom(uint i) {
    uint nodes = min(header().word[8], job.nodeCapacity);
    if (nodes == 0u && i == 0u) finish(Fitted(leafBox(header().word[2]), 0u));
    if (i >= nodes) return;
    uint node = i;
    uint first = nodeAt(node).word[3], second = nodeAt(node).word[7];
    if (!isLeaf(first) || !isLeaf(second)) return;
    Fitted one = fitLeaf(node, 0u, first);
    Fitted other = fitLeaf(node, 1u, second);
    // Each step goes one node up; a damaged structure with a circle ends too.
    for (uint steps = 0; steps < nodes; ++steps) {
        Fitted both = Fitted(join(one.box, other.box), max(one.height, other.height) + 1);
        uint parent = Words(job.parents).word[node];
        if (parent == kNone) {
            finish(both);
            return;
        }
        uint which = parent >> 29 & 1u;
        node = parent & 0x1fffffffu;
        if (node >= nodes) return;
        writeChild(node, which, both);
        uint sibling = nodeAt(node).word[which == 0u ? 7 : 3];
        one = both;
        if (isLeaf(sibling)) {
            other = fitLeaf(node, 1u - which, sibling);
        } else {
            memoryBarrierBuffer();
            if (atomicAdd(Words(work(job.arrivals)).word[node], 1u) == 0u) return;
            memoryBarrierBuffer();
            other = readChild(node, 1u - which);
        }
    }
}
