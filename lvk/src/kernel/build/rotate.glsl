// Makes a node better while both its children are at hand: Kopta et al., "Fast, Effective BVH Updates for Animated Scenes",
// I3D 2012. A child changes places with a child of the other where that makes boxes smaller and no path longer.
float areaOf(Box box) {
    vec3 side = max(box.hi - box.lo, vec3(0));
    return side.x * side.y + side.y * side.z + side.z * side.x;
}

void writeReference(uint node, uint which, uint reference) {
    Words(nodeAt(node)).word[3 + which * 4] = reference;
    if (!isLeaf(reference)) Words(job.parents).word[reference] = node | which << 29;
}

// Answers how high the node then is.
uint rotate(uint number, Node node) {
    uint height = max(node.part[2].w, node.part[3].w) + 1;
    if (job.improvements == 0u) return height;
    float gain = 0.0;
    uint side = 0u, given = kNone;  // grandchild `given` below `side` changes places with the other side
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
            uint after = max(max(sibling.height, kept.height) + 1, raised.height) + 1;
            if (saved > gain && after <= height) {
                gain = saved;
                side = inner;
                given = up;
                lower = below;
            }
        }
    }
    if (given == kNone) return height;
    uint inner = referenceOf(node, side);
    Fitted sibling = childOf(node, 1 - side);
    Fitted raised = childOf(lower, given);
    Fitted kept = childOf(lower, 1 - given);
    writeReference(inner, given, referenceOf(node, 1 - side));
    writeChild(inner, given, sibling);
    writeReference(number, 1 - side, referenceOf(lower, given));
    writeChild(number, 1 - side, raised);
    Fitted made = Fitted(join(sibling.box, kept.box), max(sibling.height, kept.height) + 1);
    writeChild(number, side, made);
    return max(made.height, raised.height) + 1;
}
