// Fits the bounds of binary nodes, bottom up. A node's own invocation starts if both children are leaves. Above, the
// invocation of the child that arrives last continues, so that none waits.
void finish(Fitted root) {
    Corners to = Corners(plus(job.blob, 48u, 0u));
    to.corner[0] = root.box.lo;
    to.corner[1] = root.box.hi;
    header().word[18] = heightOf(root.shape);
}

// Fits nodes from node `i` up to the root, as far as possible.
void fitFrom(uint i) {
    uint nodes = min(header().word[8], job.nodeCapacity);
    if (nodes == 0u && i == 0u) finish(Fitted(leafBox(header().word[2]), 0u));
    if (i >= nodes) return;
    if (Words(work(job.arrivals)).word[i] != kStart) return;
    uint number = i;
    uint which = 0u;
    fitLeaf(number, which, Words(nodeAt(number)).word[3]);
    // Each step goes one node up. A damaged BLAS with a cycle terminates too.
    [[dont_unroll]] for (uint steps = 0; steps < nodes; ++steps) {
        uint sibling = Words(nodeAt(number)).word[which == 0u ? 7 : 3];
        if (isLeaf(sibling)) {
            fitLeaf(number, 1u - which, sibling);
        } else {
            memoryBarrierBuffer();
            if (atomicAdd(Words(work(job.arrivals)).word[number], 1u) == 0u) return;
            memoryBarrierBuffer();
        }
        Node node = readNode(number);
        Fitted one = childOf(node, 0u), two = childOf(node, 1u);
        Fitted whole = Fitted(join(one.box, two.box), above(one.shape, two.shape));
        uint parent = Words(job.parents).word[number];
        if (parent == kNone) {
            finish(whole);
            return;
        }
        which = parent >> 29 & 1u;
        number = parent & 0x1fffffffu;
        if (number >= nodes) return;
        writeChild(number, which, whole);
    }
}
