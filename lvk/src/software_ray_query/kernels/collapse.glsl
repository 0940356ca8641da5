// Collapses binary nodes to nodes of eight children, from the root down, a level at a time. Every wide node replaces a
// binary node and those below it that are decided to be split. A team of eight invocations builds a node: each has a
// part of the node, and then a child. No invocation waits for another workgroup.

// Maximum nodes on a path that traversal supports.
const uint kLevels = 32u;

// Nodes that a workgroup builds at a time.
const uint kTeams = kGroup / kChildren;

uint team() { return gl_LocalInvocationIndex / kChildren; }

// The index of the invocation in its team: that of its part, later of its child.
uint own() { return gl_LocalInvocationIndex % kChildren; }

// Returns the place of a part or child of the team in shared memory.
uint teamPlace(uint at) { return gl_LocalInvocationIndex - own() + at; }

// A binary node or leaf that becomes a child of the wide node. Its share limits what it is split into.
struct Part { uint reference; uint shape; uint share; Box box; };

shared uint partReference[kGroup];
shared uint partShape[kGroup];
shared uint partShare[kGroup];
shared vec3 partLow[kGroup];
shared vec3 partHigh[kGroup];
shared uint teamBits[kTeams];
shared bool isAnySet;

// Adds the bit of an invocation. Returns the bits of the team.
uint bitsOfTeam(bool isSet) {
    barrier();
    if (own() == 0u) teamBits[team()] = 0u;
    if (gl_LocalInvocationIndex == 0u) isAnySet = false;
    barrier();
    if (isSet) {
        atomicOr(teamBits[team()], 1u << own());
        isAnySet = true;
    }
    barrier();
    return teamBits[team()];
}

Part halfOf(uint number, uint which, uint share) {
    Node node = readNode(number);
    Fitted half_ = childOf(node, which);
    return Part(referenceOf(node, which), half_.shape, share, half_.box);
}

// Returns the first part of the team with the greatest height.
uint highestPart(uint count) {
    uint highest = 0u;
    [[dont_unroll]] for (uint k = 1u; k < count; ++k) {
        if (heightOf(partShape[teamPlace(k)]) > heightOf(partShape[teamPlace(highest)])) highest = k;
    }
    return highest;
}

// Returns the shares of the halves of a part that is split, else kNone. Parts are split as decided, or the highest while
// there is room, so that three levels of binary nodes end here.
uvec2 splitOf(Part part, uint count, bool isTall) {
    if (own() >= count || isLeaf(part.reference)) return uvec2(kNone);
    if (!isTall) return part.share == 0u ? uvec2(kNone) : sharesOf(decisionOf(part.reference), part.share);
    return count < kChildren && own() == highestPart(count) ? uvec2(0) : uvec2(kNone);
}

// Splits the subtree of a binary node into the parts of the wide node that replaces it, one for each invocation. Returns
// their number. Parts are split as decided, unless paths would exceed the depth of traversal.
uint cutBelow(uint number, bool exists, uint level, out Part part) {
    part = Part(kNone, 0u, 0u, emptyBox());
    bool isTall = false;
    uint count = exists ? 2u : 0u;
    if (exists) {
        Node top = readNode(number);
        isTall = (heightOf(above(top.part[2].w, top.part[3].w)) + 1u) / 3u > kLevels - 1u - level;
        uint first = decisionOf(number) & 7u;
        if (own() < 2u) part = halfOf(number, own(), own() == 0u ? first : kShares - 1u - first);
    }
    [[dont_unroll]] while (true) {
        partShape[gl_LocalInvocationIndex] = part.shape;
        barrier();
        uvec2 shares = splitOf(part, count, isTall);
        bool isSplit = shares.x != kNone;
        if (!isSplit) part.share = 0u;
        uint bits = bitsOfTeam(isSplit);
        if (!isAnySet) return count;
        if (isSplit) {
            uint added = teamPlace(count + bitCount(bits & (1u << own()) - 1u));
            partReference[added] = part.reference;
            partShare[added] = shares.y;
            part = halfOf(part.reference, 0u, shares.x);
        }
        barrier();
        uint more = count + bitCount(bits);
        uint t = gl_LocalInvocationIndex;
        if (own() >= count && own() < more) part = halfOf(partReference[t], 1u, partShare[t]);
        count = more;
    }
}

void sharePart(Part part) {
    uint t = gl_LocalInvocationIndex;
    barrier();
    partReference[t] = part.reference;
    partShape[t] = part.shape;
    partLow[t] = part.box.lo;
    partHigh[t] = part.box.hi;
    barrier();
}

Box partBox(uint at) { return Box(partLow[teamPlace(at)], partHigh[teamPlace(at)]); }

// Returns the union of the parts, which are shared.
Box wholeBox(uint count) {
    Box whole = emptyBox();
    [[dont_unroll]] for (uint k = 0u; k < count; ++k) whole = join(whole, partBox(k));
    return whole;
}

// For each part the best free child, and the distance of the part along the direction of that child.
shared uint bestChild[kGroup];
shared float bestAlong[kGroup];

// The part of each child; kNone for a missing child.
shared uint partOfChild[kGroup];

void findChild(vec3 offset, uint taken) {
    uint t = gl_LocalInvocationIndex;
    float least = kFar;
    uint found = 0u;
    [[unroll]] for (uint child = 0u; child < kChildren; ++child) {
        vec3 along = mix(offset, -offset, notEqual(uvec3(child) & uvec3(4u, 2u, 1u), uvec3(0)));
        float sum = along.x + along.y + along.z;
        if ((taken >> child & 1u) == 0u && sum < least) {
            least = sum;
            found = child;
        }
    }
    bestAlong[t] = least;
    bestChild[t] = found;
}

// Assigns a child to each part. Rays visit the parts along their direction, seen from the middle, last. The outermost
// part chooses first.
void order(Box box, vec3 middle, uint count) {
    uint t = gl_LocalInvocationIndex;
    partOfChild[t] = kNone;
    bool waits = own() < count;
    uint taken = 0u;
    [[dont_unroll]] for (uint round_ = 0u; round_ < kChildren; ++round_) {
        bestAlong[t] = kFar;
        if (waits) findChild(centre(box) - middle, taken);
        barrier();
        uint first = kNone;
        float least = kFar;
        [[dont_unroll]] for (uint k = 0u; k < count; ++k) {
            if (bestAlong[teamPlace(k)] < least) {
                least = bestAlong[teamPlace(k)];
                first = k;
            }
        }
        if (first != kNone) taken |= 1u << bestChild[teamPlace(first)];
        if (first == own()) {
            partOfChild[teamPlace(bestChild[t])] = own();
            waits = false;
        }
        barrier();
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
shared uint teamRoom[kTeams];

// Allocates consecutive nodes for the children of each team. Returns the first, or kNone if those of the workgroup do
// not fit.
uint roomForNodes(uint count, uint level) {
    bool isFirst = gl_LocalInvocationIndex == 0u;
    if (isFirst) roomCount = 0u;
    barrier();
    if (own() == 0u) teamRoom[team()] = atomicAdd(roomCount, count);
    barrier();
    if (isFirst && roomCount > 0u) {
        uint first = atomicAdd(state().word[kWideNodes], roomCount);
        bool fits = first + roomCount <= job.wideCapacity;
        if (fits) atomicMax(state().word[kEnds + level + 1u], first + roomCount);
        roomFirst = fits ? first : kNone;
    }
    barrier();
    if (roomCount == 0u) return 0u;
    return roomFirst == kNone ? kNone : roomFirst + teamRoom[team()];
}

// Numbers of primitives below the children.
shared uint childCount[kGroup];

// Returns the primitives of the children with these bits.
uint countOfChildren(uint bits) {
    uint count = 0u;
    [[dont_unroll]] for (uint child = 0u; child < kChildren; ++child) {
        if ((bits >> child & 1u) != 0u) count += childCount[teamPlace(child)];
    }
    return count;
}

// The words of the nodes of all teams. Only written nodes have the mark.
shared uint nodeWords[kTeams * kWideWords];
shared bool isWritten[kTeams];

void addByte(uint word, uint byte_) {
    atomicOr(nodeWords[team() * kWideWords + word + own() / 4u], byte_ << (own() & 3u) * 8u);
}

// Adds the bounds of a child.
void addBounds(Box box, vec3 corner, uvec3 exponentOfAxis) {
    bool none = isEmpty(box);
    [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) {
        float unit = uintBitsToFloat(exponentOfAxis[axis] << 23);
        addByte(8u + axis * 4u, none ? 255u : stepsDown(box.lo[axis] - corner[axis], unit));
        addByte(10u + axis * 4u, none ? 0u : stepsUp(box.hi[axis] - corner[axis], unit));
    }
}

void addNode(vec3 corner, uvec3 exponentOfAxis, uint inner, uint firstNode, uint firstSlot) {
    uint at = team() * kWideWords;
    [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) nodeWords[at + axis] = floatBitsToUint(corner[axis]);
    nodeWords[at + 3u] = exponentOfAxis.x | exponentOfAxis.y << 8 | exponentOfAxis.z << 16 | inner << 24;
    nodeWords[at + 4u] = firstNode;
    nodeWords[at + 5u] = firstSlot;
}

// Writes the references to the primitives or to the node of a child. Returns its meta byte. The primitives below a node
// have consecutive slots, those of its own leaves first.
uint writeChildReferences(uint reference, uint shape, uint inner, uint all_, uint firstNode, uint firstSlot) {
    uint before_ = (1u << own()) - 1u, leaves = all_ & ~inner;
    if ((all_ >> own() & 1u) == 0u) return 0u;
    if ((leaves >> own() & 1u) != 0u) {
        uint slot = countOfChildren(leaves & before_);
        placeGroup(firstSlot + slot, reference);
        return (1u << countOf(shape)) - 1u << 5 | slot;
    }
    Words below = wideAt(firstNode + bitCount(inner & before_));
    below.word[0] = reference;
    below.word[1] = firstSlot + countOfChildren(leaves) + countOfChildren(inner & before_);
    return 0x20u | 24u + own();
}

// Writes the nodes of all teams.
void writeNodes(uint first) {
    barrier();
    [[dont_unroll]] for (uint at = gl_LocalInvocationIndex; at < kTeams * kWideWords; at += kGroup) {
        uint of = at / kWideWords;
        if (isWritten[of]) wideAt(first + of).word[at - of * kWideWords] = nodeWords[at];
    }
}

// Builds the wide nodes from `first` to before `end`, at most as many as there are teams.
void collapse(uint first, uint end, uint level) {
    uint t = gl_LocalInvocationIndex;
    [[dont_unroll]] for (uint at = t; at < kTeams * kWideWords; at += kGroup) nodeWords[at] = 0u;
    bool exists = first + team() < end;
    uint number = 0u, firstSlot = 0u;
    if (exists) {
        Words from = wideAt(first + team());
        number = from.word[0];
        firstSlot = from.word[1];
    }
    Part part;
    uint count = cutBelow(number, exists, level, part);
    sharePart(part);
    Box whole = wholeBox(count);
    order(part.box, centre(whole), count);
    bool hasPart = partOfChild[t] != kNone;
    uint from = teamPlace(hasPart ? partOfChild[t] : 0u);
    uint reference = partReference[from], shape = partShape[from];
    bool isInner = hasPart && !isGroup(shape);
    childCount[t] = isInner ? Words(job.parents).word[reference] : hasPart ? countOf(shape) : 0u;
    uint all_ = bitsOfTeam(hasPart);
    uint inner = bitsOfTeam(isInner);
    uint firstNode = roomForNodes(bitCount(inner), level);
    bool isComplete = exists && firstNode != kNone;
    if (own() == 0u) isWritten[team()] = isComplete;
    if (isComplete) {
        addByte(6u, writeChildReferences(reference, shape, inner, all_, firstNode, firstSlot));
        uvec3 exponentOfAxis = exponentsOf(whole.hi - whole.lo);
        addBounds(hasPart ? Box(partLow[from], partHigh[from]) : emptyBox(), whole.lo, exponentOfAxis);
        if (own() == 0u) addNode(whole.lo, exponentOfAxis, inner, firstNode, firstSlot);
    }
    writeNodes(first);
    barrier();
}

// Returns the range of the wide nodes of a level: the first, and the one after the last.
uvec2 nodesOfLevel(uint level) {
    Words all_ = state();
    return uvec2(level == 0u ? 0u : all_.word[kEnds + level - 1u], all_.word[kEnds + level]);
}
