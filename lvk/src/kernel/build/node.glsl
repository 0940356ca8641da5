// Binary nodes.
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

void fitLeaf(uint node, uint which, uint reference) { writeChild(node, which, Fitted(leafBox(reference), 0u)); }

