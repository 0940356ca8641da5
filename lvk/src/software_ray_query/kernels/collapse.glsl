// Collapses binary nodes to nodes of eight children, from the root down, a level at a time. Every wide node replaces a
// binary node and as many nodes below it as fit, the largest first. No invocation waits for another.

// Maximum nodes on a path that traversal supports.
const uint kLevels = 32u;

// A subtree of at most this many groups becomes no node of its own: its groups become leaves of the node above. So no
// node has few children, and all nodes fit.
const uint kFewGroups = 4u;

// Gain of splitting a group, relative to that of splitting a node.
const float kGroupWorth = 0.5;

// The parts of a wide node: binary nodes and leaves.
uint cutCount;
uint cutReference[kChildren];
uint cutShape[kChildren];
Box cutBox[kChildren];

void setCut(uint at, uint reference, Fitted what) {
    cutReference[at] = reference;
    cutShape[at] = what.shape;
    cutBox[at] = what.box;
}

bool isGroup(uint shape) { return countOf(shape) <= kMostOfGroup; }

// Returns the minimum children that a subtree of this shape needs.
uint childrenOf(uint shape, bool isTall) {
    uint groups = groupsOf(shape);
    return isTall || groups > kFewGroups ? 1u : groups;
}

// Returns the part to split next: the largest, or the tallest if the subtree is too tall; kNone if none is left.
uint nextToOpen(uint closed, bool isTall) {
    uint next = kNone;
    float most = -1.0;
    [[dont_unroll]] for (uint k = 0; k < cutCount; ++k) {
        if (isLeaf(cutReference[k]) || (closed >> k & 1u) != 0u) continue;
        float area = areaOf(cutBox[k]) * (isGroup(cutShape[k]) ? kGroupWorth : 1.0);
        float worth = isTall ? float(heightOf(cutShape[k])) : area;
        if (worth > most) {
            most = worth;
            next = k;
        }
    }
    return next;
}

// Splits the subtree of a binary node into the children of the wide node that replaces it. If paths would exceed the
// depth of traversal, the tallest part is split first, so that three levels end here.
void cutBelow(uint number, uint level) {
    Node top = readNode(number);
    [[dont_unroll]] for (uint which = 0; which < 2; ++which) setCut(which, referenceOf(top, which), childOf(top, which));
    cutCount = 2u;
    bool isTall = (heightOf(above(cutShape[0], cutShape[1])) + 1u) / 3u > kLevels - 1u - level;
    uint taken = childrenOf(cutShape[0], isTall) + childrenOf(cutShape[1], isTall);
    uint closed = 0u;  // parts that do not fit if split
    [[dont_unroll]] while (cutCount < kChildren) {
        uint next = nextToOpen(closed, isTall);
        if (next == kNone) return;
        Node below = readNode(cutReference[next]);
        Fitted one = childOf(below, 0u), two = childOf(below, 1u);
        uint more = childrenOf(one.shape, isTall) + childrenOf(two.shape, isTall) - childrenOf(cutShape[next], isTall);
        if (taken + more > kChildren) {
            closed |= 1u << next;
            continue;
        }
        taken += more;
        setCut(next, referenceOf(below, 0u), one);
        setCut(cutCount, referenceOf(below, 1u), two);
        cutCount += 1u;
    }
}

// The index of the part of each child; kNone for a missing child.
uint cutOf[kChildren];

// For each part the best free child, and the part's distance along the direction of that child.
uint cutChild[kChildren];
float cutAlong[kChildren];

void findChild(uint k, vec3 middle) {
    vec3 offset = centre(cutBox[k]) - middle;
    cutAlong[k] = kFar;
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        vec3 along = mix(offset, -offset, notEqual(uvec3(child) & uvec3(4u, 2u, 1u), uvec3(0)));
        float sum = along.x + along.y + along.z;
        if (cutOf[child] == kNone && sum < cutAlong[k]) {
            cutAlong[k] = sum;
            cutChild[k] = child;
        }
    }
}

// Assigns a child to each part. Rays visit the parts along their direction, seen from the middle, last. The outermost
// part chooses first.
void order() {
    Box whole = cutBox[0];
    [[dont_unroll]] for (uint k = 1; k < cutCount; ++k) whole = join(whole, cutBox[k]);
    vec3 middle = centre(whole);
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) cutOf[child] = kNone;
    [[dont_unroll]] for (uint k = 0; k < cutCount; ++k) findChild(k, middle);
    uint waiting = (1u << cutCount) - 1u;
    [[dont_unroll]] while (waiting != 0u) {
        uint first = uint(findLSB(waiting));
        [[dont_unroll]] for (uint k = first + 1u; k < cutCount; ++k) {
            if ((waiting >> k & 1u) != 0u && cutAlong[k] < cutAlong[first]) first = k;
        }
        uint taken = cutChild[first];
        cutOf[taken] = first;
        waiting &= ~(1u << first);
        [[dont_unroll]] for (uint k = 0; k < cutCount; ++k) {
            if ((waiting >> k & 1u) != 0u && cutChild[k] == taken) findChild(k, middle);
        }
    }
}

void placePrimitive(uint slot, uint reference) { Words(work(job.spareKeys)).word[slot] = reference & 0x07ffffffu; }

// Writes up to three primitives to consecutive slots.
void placeGroup(uint slot, uint reference) {
    if (isLeaf(reference)) {
        placePrimitive(slot, reference);
        return;
    }
    Words top = Words(nodeAt(reference));
    [[dont_unroll]] for (uint which = 0; which < 2; ++which) {
        uint child = top.word[3 + which * 4];
        if (isLeaf(child)) {
            placePrimitive(slot++, child);
        } else {
            Words pair = Words(nodeAt(child));
            placePrimitive(slot++, pair.word[3]);
            placePrimitive(slot++, pair.word[7]);
        }
    }
}

// Allocates consecutive nodes; returns kNone if they do not fit.
uint roomForNodes(uint count, uint level) {
    if (count == 0u) return 0u;
    uint first = atomicAdd(state().word[kWideNodes], count);
    if (first + count > job.wideCapacity) return kNone;
    atomicMax(state().word[kEnds + level + 1u], first + count);
    return first;
}

// Writes a wide node except its bounds, and the binary node of each wide child into that child. Returns false if the
// children do not fit.
bool link(Words node, uint level) {
    uint inner = 0u, count = 0u;
    uvec2 metas = uvec2(0);
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        if (cutOf[child] == kNone) continue;
        uint shape = cutShape[cutOf[child]];
        uint meta = 0x20u | 24u + child;
        if (isGroup(shape)) {
            meta = (1u << countOf(shape)) - 1u << 5 | count;
            count += countOf(shape);
        } else {
            inner |= 1u << child;
        }
        metas[child / 4] |= meta << (child & 3u) * 8u;
    }
    uint firstNode = roomForNodes(bitCount(inner), level);
    if (firstNode == kNone) return false;
    uint firstSlot = count == 0u ? 0u : atomicAdd(state().word[kPlaced], count);
    node.word[3] = inner << 24;
    node.word[4] = firstNode;
    node.word[5] = firstSlot;
    node.word[6] = metas.x;
    node.word[7] = metas.y;
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        if (cutOf[child] == kNone) continue;
        uint reference = cutReference[cutOf[child]];
        uint shape = cutShape[cutOf[child]];
        if (isGroup(shape)) {
            placeGroup(firstSlot, reference);
            firstSlot += countOf(shape);
        } else {
            wideAt(firstNode++).word[0] = reference;
        }
    }
    return true;
}

// Builds wide node `i`.
void collapse(uint i, uint level) {
    Words node = wideAt(i);
    cutBelow(node.word[0], level);
    order();
    if (!link(node, level)) return;
    Box child[kChildren];
    [[dont_unroll]] for (uint k = 0; k < kChildren; ++k) child[k] = cutOf[k] == kNone ? emptyBox() : cutBox[cutOf[k]];
    encode(node, child);
}

// Returns the range of the wide nodes of a level: the first, and the one after the last.
uvec2 nodesOfLevel(uint level) {
    Words all_ = state();
    return uvec2(level == 0u ? 0u : all_.word[kEnds + level - 1u], all_.word[kEnds + level]);
}
