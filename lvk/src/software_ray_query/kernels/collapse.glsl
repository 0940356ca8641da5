// Collapses binary nodes to nodes of eight children, from the root down, a level at a time. Every wide node replaces a
// binary node and those below it that are decided to be split. No invocation waits for another workgroup.

// Maximum nodes on a path that traversal supports.
const uint kLevels = 32u;

// The parts of a wide node: binary nodes and leaves, and the share of each.
uint cutCount;
uint cutReference[kChildren];
uint cutShape[kChildren];
uint cutShare[kChildren];
Box cutBox[kChildren];

void setCut(uint at, uint reference, uint share, Fitted what) {
    cutReference[at] = reference;
    cutShape[at] = what.shape;
    cutShare[at] = share;
    cutBox[at] = what.box;
}

// Replaces a part by the halves of its node.
void splitCut(uint at, uvec2 shares) {
    Node below = readNode(cutReference[at]);
    setCut(at, referenceOf(below, 0u), shares.x, childOf(below, 0u));
    setCut(cutCount, referenceOf(below, 1u), shares.y, childOf(below, 1u));
    cutCount += 1u;
}

// Splits the highest part until there is no more room, so that three levels of binary nodes end here.
void cutHighest() {
    [[dont_unroll]] while (cutCount < kChildren) {
        uint next = 0u;
        [[dont_unroll]] for (uint k = 1u; k < cutCount; ++k) {
            if (heightOf(cutShape[k]) > heightOf(cutShape[next])) next = k;
        }
        if (isLeaf(cutReference[next])) return;
        splitCut(next, uvec2(0));
    }
}

// Splits the subtree of a binary node into the children of the wide node that replaces it: as decided, unless paths
// would exceed the depth of traversal.
void cutBelow(uint number, uint level) {
    Node top = readNode(number);
    uint first = decisionOf(number) & 7u;
    setCut(0u, referenceOf(top, 0u), first, childOf(top, 0u));
    setCut(1u, referenceOf(top, 1u), kShares - 1u - first, childOf(top, 1u));
    cutCount = 2u;
    if ((heightOf(above(cutShape[0], cutShape[1])) + 1u) / 3u > kLevels - 1u - level) {
        cutHighest();
        return;
    }
    [[dont_unroll]] for (uint k = 0u; k < cutCount;) {
        uvec2 shares = uvec2(kNone);
        if (!isLeaf(cutReference[k]) && cutShare[k] > 0u) shares = sharesOf(decisionOf(cutReference[k]), cutShare[k]);
        if (shares.x == kNone) ++k; else splitCut(k, shares);
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

// The nodes that the workgroup allocates, and the first of them.
shared uint roomCount;
shared uint roomFirst;

// Allocates consecutive nodes for each invocation of the workgroup; returns kNone if those of the workgroup do not fit.
uint roomForNodes(uint count, uint level) {
    bool isFirst = gl_LocalInvocationIndex == 0u;
    if (isFirst) roomCount = 0u;
    barrier();
    uint before_ = count == 0u ? 0u : atomicAdd(roomCount, count);
    barrier();
    if (isFirst && roomCount > 0u) {
        uint first = atomicAdd(state().word[kWideNodes], roomCount);
        bool fits = first + roomCount <= job.wideCapacity;
        if (fits) atomicMax(state().word[kEnds + level + 1u], first + roomCount);
        roomFirst = fits ? first : kNone;
    }
    barrier();
    if (roomCount == 0u) return 0u;
    return roomFirst == kNone ? kNone : roomFirst + before_;
}

// Returns the bits of the children that become nodes.
uint innerChildren() {
    uint inner = 0u;
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        if (cutOf[child] != kNone && !isGroup(cutShape[cutOf[child]])) inner |= 1u << child;
    }
    return inner;
}

// Writes the references of a wide node to its children and primitives.
void writeReferences(Words node, uint inner, uint firstNode, uint firstSlot) {
    uint count = 0u;
    uvec2 metas = uvec2(0);
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        if (cutOf[child] == kNone) continue;
        uint below = countOf(cutShape[cutOf[child]]);
        bool isInner = (inner >> child & 1u) != 0u;
        uint meta = isInner ? 0x20u | 24u + child : (1u << below) - 1u << 5 | count;
        if (!isInner) {
            placeGroup(firstSlot + count, cutReference[cutOf[child]]);
            count += below;
        }
        metas[child / 4] |= meta << (child & 3u) * 8u;
    }
    node.word[3] = inner << 24;
    node.word[4] = firstNode;
    node.word[5] = firstSlot;
    node.word[6] = metas.x;
    node.word[7] = metas.y;
    firstSlot += count;
    [[dont_unroll]] for (uint child = 0; child < kChildren; ++child) {
        if ((inner >> child & 1u) == 0u) continue;
        uint reference = cutReference[cutOf[child]];
        Words below = wideAt(firstNode++);
        below.word[0] = reference;
        below.word[1] = firstSlot;
        firstSlot += Words(job.parents).word[reference];
    }
}

// Builds a wide node for each invocation of the workgroup, from node `i` if it exists. The primitives below each node
// have consecutive slots, those of its own leaves first.
void collapse(uint i, bool exists, uint level) {
    Words node = wideAt(i);
    uint inner = 0u;
    if (exists) {
        cutBelow(node.word[0], level);
        order();
        inner = innerChildren();
    }
    uint firstNode = roomForNodes(bitCount(inner), level);
    if (!exists || firstNode == kNone) return;
    writeReferences(node, inner, firstNode, node.word[1]);
    Box child[kChildren];
    [[dont_unroll]] for (uint k = 0; k < kChildren; ++k) child[k] = cutOf[k] == kNone ? emptyBox() : cutBox[cutOf[k]];
    encode(node, child);
}

// Returns the range of the wide nodes of a level: the first, and the one after the last.
uvec2 nodesOfLevel(uint level) {
    Words all_ = state();
    return uvec2(level == 0u ? 0u : all_.word[kEnds + level - 1u], all_.word[kEnds + level]);
}
