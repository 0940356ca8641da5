// Packed trees replace wide nodes that did not fit, which happens for very unbalanced trees. Their nodes are full, with
// primitives in the order of their codes. They fit for any count.
const uint kFullLeaves = kChildren * kMostOfGroup;

bool isPacked() { return state().word[kWideNodes] > job.wideCapacity; }

// Returns the number of nodes in the lowest level, and in all levels.
uvec2 packedNodes() {
    uint level = (state().word[kActive] + kFullLeaves - 1u) / kFullLeaves;
    uvec2 found = uvec2(level);
    [[dont_unroll]] while (level > 1u) {
        level = (level + kChildren - 1u) / kChildren;
        found.y += level;
    }
    return found;
}

void writePackedLeaves(Words node, uint first) {
    uint count = min(state().word[kActive] - first, kFullLeaves);
    uvec2 metas = uvec2(0);
    [[dont_unroll]] for (uint at = 0u; at < count; at += kMostOfGroup) {
        uint child = at / kMostOfGroup;
        metas[child / 4] |= ((1u << min(count - at, kMostOfGroup)) - 1u << 5 | at) << (child & 3u) * 8u;
    }
    node.word[3] = 0u;
    node.word[4] = 0u;
    node.word[5] = first;
    node.word[6] = metas.x;
    node.word[7] = metas.y;
}

void writePackedChildren(Words node, uint number, uint first, uint count) {
    node.word[3] = (1u << count) - 1u << 24;
    node.word[4] = first;
    node.word[5] = 0u;
    node.word[6] = 0x3b3a3938u & (count < 4u ? (1u << count * 8u) - 1u : kNone);
    node.word[7] = 0x3f3e3d3cu & (count < 4u ? 0u : count < 8u ? (1u << (count - 4u) * 8u) - 1u : kNone);
    [[dont_unroll]] for (uint child = 0; child < count; ++child) writeParent(first + child, number, 0u);
}

// Writes node `i` except its bounds. Levels follow each other, the root first.
void writePacked(uint i) {
    uvec2 nodes = packedNodes();
    if (i >= nodes.y) return;
    writeArrivals(i, false);
    if (i == 0u) Words(job.parents).word[0] = kNone;
    Words node = wideAt(i);
    uint level = nodes.x, first = nodes.y - nodes.x;
    if (i >= first) {
        writePackedLeaves(node, (i - first) * kFullLeaves);
        return;
    }
    uint below, count;
    [[dont_unroll]] do {
        below = first;
        count = level;
        level = (level + kChildren - 1u) / kChildren;
        first -= level;
    } while (i < first);
    uint taken = (i - first) * kChildren;
    writePackedChildren(node, i, below + taken, min(count - taken, kChildren));
}
