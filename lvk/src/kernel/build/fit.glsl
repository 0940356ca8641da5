// Fits the boxes of binary nodes, bottom up. A node's own invocation starts where both children are leaves; above, the
// child that arrives last goes on, so that nobody ever waits.
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
    if (Words(work(job.arrivals)).word[i] != kStart) return;
    uint node = i;
    uint which = 0u;
    fitLeaf(node, which, nodeAt(node).word[3]);
    // Each step goes one node up; a damaged structure with a circle ends too.
    [[dont_unroll]] for (uint steps = 0; steps < nodes; ++steps) {
        uint sibling = nodeAt(node).word[which == 0u ? 7 : 3];
        if (isLeaf(sibling)) {
            fitLeaf(node, 1u - which, sibling);
        } else {
            memoryBarrierBuffer();
            if (atomicAdd(Words(work(job.arrivals)).word[node], 1u) == 0u) return;
            memoryBarrierBuffer();
        }
        uint height = rotate(node);
        Fitted whole = Fitted(join(readChild(node, 0u).box, readChild(node, 1u).box), height);
        uint parent = Words(job.parents).word[node];
        if (parent == kNone) {
            finish(whole);
            return;
        }
        which = parent >> 29 & 1u;
        node = parent & 0x1fffffffu;
        if (node >= nodes) return;
        writeChild(node, which, whole);
    }
}
