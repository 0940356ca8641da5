// Makes a node better while both its children are at hand: Kopta et al., "Fast, Effective BVH Updates for Animated Scenes",
// I3D 2012. A child changes places with a child of the other where that makes boxes smaller and no path longer.
float areaOf(Box box) {
    vec3 side = max(box.hi - box.lo, vec3(0));
    return side.x * side.y + side.y * side.z + side.z * side.x;
}

uint referenceOf(uint node, uint which) { return nodeAt(node).word[3 + which * 4]; }

void writeReference(uint node, uint which, uint reference) {
    nodeAt(node).word[3 + which * 4] = reference;
    if (!isLeaf(reference)) Words(job.parents).word[reference] = node | which << 29;
}

// Answers how high the node then is.
uint rotate(uint node) {
    Fitted child[2] = Fitted[2](readChild(node, 0u), readChild(node, 1u));
    uint reference[2] = uint[2](referenceOf(node, 0u), referenceOf(node, 1u));
    uint height = max(child[0].height, child[1].height) + 1;
    float gain = 0.0;
    uint side = 0u, given = kNone;  // grandchild `given` below `side` changes places with the other side
    [[dont_unroll]] for (uint inner = 0; inner < 2; ++inner) {
        if (isLeaf(reference[inner])) continue;
        Fitted sibling = child[1 - inner];
        float before = areaOf(child[inner].box);
        [[dont_unroll]] for (uint up = 0; up < 2; ++up) {
            Fitted raised = readChild(reference[inner], up);
            Fitted kept = readChild(reference[inner], 1 - up);
            float saved = before - areaOf(join(sibling.box, kept.box));
            uint after = max(max(sibling.height, kept.height) + 1, raised.height) + 1;
            if (saved > gain && after <= height) {
                gain = saved;
                side = inner;
                given = up;
            }
        }
    }
    if (given == kNone || job.improvements == 0u) return height;
    uint inner = reference[side];
    Fitted sibling = child[1 - side];
    Fitted raised = readChild(inner, given);
    Fitted kept = readChild(inner, 1 - given);
    uint raisedReference = referenceOf(inner, given);
    writeReference(inner, given, reference[1 - side]);
    writeChild(inner, given, sibling);
    writeReference(node, 1 - side, raisedReference);
    writeChild(node, 1 - side, raised);
    Fitted lower = Fitted(join(sibling.box, kept.box), max(sibling.height, kept.height) + 1);
    writeChild(node, side, lower);
    return max(lower.height, raised.height) + 1;
}
