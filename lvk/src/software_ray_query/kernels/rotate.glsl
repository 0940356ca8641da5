// Rotates a node once both its children are fitted: Kopta et al., "Fast, Effective BVH Updates for Animated Scenes",
// I3D 2012. A child and a child of its sibling are swapped if that shrinks bounds and makes no path longer.
void writeReference(uint node, uint which, uint reference) {
    Words(nodeAt(node)).word[3 + which * 4] = reference;
    if (!isLeaf(reference)) Words(job.parents).word[reference] = node | which << 29;
}

// Returns the shape of the node after the rotation.
uint rotate(uint number, Node node) {
    uint shape = above(node.part[2].w, node.part[3].w);
    if (job.improvements == 0u) return shape;
    uint height = heightOf(shape);
    float gain = 0.0;
    uint side = 0u, given = kNone;  // grandchild `given` below `side` is swapped with the other side
    Node lower;
    [[dont_unroll]] for (uint inner = 0; inner < 2; ++inner) {
        uint reference = referenceOf(node, inner);
        if (isLeaf(reference)) continue;
        Node below = readNode(reference);
        Fitted sibling = childOf(node, 1 - inner);
        float before = areaOf(childOf(node, inner).box);
        for (uint up = 0; up < 2; ++up) {
            Fitted raised = childOf(below, up);
            Fitted kept = childOf(below, 1 - up);
            float saved = before - areaOf(join(sibling.box, kept.box));
            uint after = heightOf(above(above(sibling.shape, kept.shape), raised.shape));
            if (saved > gain && after <= height) {
                gain = saved;
                side = inner;
                given = up;
                lower = below;
            }
        }
    }
    if (given == kNone) return shape;
    uint inner = referenceOf(node, side);
    Fitted sibling = childOf(node, 1 - side);
    Fitted raised = childOf(lower, given);
    Fitted kept = childOf(lower, 1 - given);
    writeReference(inner, given, referenceOf(node, 1 - side));
    writeChild(inner, given, sibling);
    writeReference(number, 1 - side, referenceOf(lower, given));
    writeChild(number, 1 - side, raised);
    Fitted made = Fitted(join(sibling.box, kept.box), above(sibling.shape, kept.shape));
    writeChild(number, side, made);
    return above(made.shape, raised.shape);
}
