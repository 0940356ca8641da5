// The binary tree, bottom up, in one dispatch: Benthin, Meister, Barczak, Mehalwal, Tsakok, Kensler, "H-PLOC: Hierarchical
// Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction", HPG 2024. Every range of the implicit
// hierarchy of codes is left as few clusters (subtrees). Invocations walk from the leaves up; of two that meet, the last
// goes on with both ranges. Where a range has many leaves, the workgroup joins the clusters of both halves and merges
// nearest neighbours among them until few are left. No invocation waits for another workgroup.

// Clusters that stay of a range, and leaves of a range whose leaves are its clusters.
const uint kStaying = kGroup / 2u;

// Neighbours on each side that a cluster is compared with.
const uint kReach = 8u;

// After this many rounds, clusters are merged by their position.
const uint kRounds = 16u;

// Maximum height of the tree.
const uint kHighest = 64u;

// A subtree that has no parent yet. Each leaf of a range gives its index to one merged pair, except the last leaf:
// `last` is the largest index of the leaves below, which no node has.
struct Cluster { Box box; uint reference; uint shape; uint last; uint count; };

// The clusters of the range that the workgroup merges, in the order of their codes.
shared vec3 clusterLow[kGroup];
shared vec3 clusterHigh[kGroup];
shared uvec4 clusterRest[kGroup];
shared float clusterCost[kShares * kGroup];
shared uint nearest[kGroup];

// For each invocation, the range that it reached: the first leaf, the first of the second half, and the last.
shared uvec3 reached[kGroup];

// A bit for each invocation: it reached a range of many leaves; its cluster exists.
shared uint arrived;
shared uint present;

Box clusterBox(uint at) { return Box(clusterLow[at], clusterHigh[at]); }

Cluster clusterAt(uint at) {
    uvec4 rest = clusterRest[at];
    return Cluster(clusterBox(at), rest.x, rest.y, rest.z, rest.w);
}

void putCluster(uint at, Cluster cluster) {
    clusterLow[at] = cluster.box.lo;
    clusterHigh[at] = cluster.box.hi;
    clusterRest[at] = uvec4(cluster.reference, cluster.shape, cluster.last, cluster.count);
}

Costs costsAt(uint at) {
    Costs costs;
    [[unroll]] for (uint share = 0u; share < kShares; ++share) costs.of[share] = clusterCost[share * kGroup + at];
    return costs;
}

void putCosts(uint at, Costs costs) {
    [[unroll]] for (uint share = 0u; share < kShares; ++share) clusterCost[share * kGroup + at] = costs.of[share];
}

// True if wide nodes replace the binary ones.
bool isDecided() { return job.wideCapacity != 0u; }

// Adds the bit of an invocation, and returns the bits of all.
uint bitsOf(bool isSet) {
    if (gl_LocalInvocationIndex == 0u) present = 0u;
    barrier();
    if (isSet) atomicOr(present, 1u << gl_LocalInvocationIndex);
    barrier();
    return present;
}

uint bitsBelow(uint bits) { return bitCount(bits & (1u << gl_LocalInvocationIndex) - 1u); }

// The two words of each cluster that stays of a range: its reference, and `last`.
Words stayingClusters() { return Words(work(job.spareKeys)); }

// Numbers of primitives below each node.
Words primitiveCounts() { return Words(job.parents); }

Cluster readCluster(uint reference, uint last) {
    if (isLeaf(reference)) return Cluster(leafBox(reference), reference, kLeafShape, last, 1u);
    Node node = readNode(reference);
    Fitted one = childOf(node, 0u), two = childOf(node, 1u);
    uint count = primitiveCounts().word[reference];
    return Cluster(join(one.box, two.box), reference, above(one.shape, two.shape), last, count);
}

// Joins the clusters of both halves of a range; returns their number.
uint joinHalves(uvec3 range) {
    uint t = gl_LocalInvocationIndex;
    bool isSecond = t >= kStaying;
    uint start = isSecond ? range.y : range.x;
    uint leaves = (isSecond ? range.z + 1u : range.y) - start;
    uint at = start + (t & kStaying - 1u);
    uint reference = kNone, last = at;
    if (leaves > kStaying) {
        reference = stayingClusters().word[2u * at];
        last = stayingClusters().word[2u * at + 1u];
    } else if (at < start + leaves) {
        reference = leafReference(at);
    }
    bool exists = reference != kNone;
    Cluster cluster;
    Costs costs;
    if (exists) {
        cluster = readCluster(reference, last);
        if (isDecided()) costs = costsOf(reference, areaOf(cluster.box));
    }
    uint bits = bitsOf(exists);
    if (exists) {
        putCluster(bitsBelow(bits), cluster);
        if (isDecided()) putCosts(bitsBelow(bits), costs);
    }
    barrier();
    return bitCount(bits);
}

// Returns the area of the union of two clusters, below kFar. Triangles are clamped where they are read. Instances may be so far away
// that their areas overflow.
float unionAreaOf(Box a, Box b) {
    Box both = join(a, b);
    if (job.leafKind == kInstances) both = Box(ended(both.lo), ended(both.hi));
    return areaOf(both);
}

// Areas of the unions of each cluster with those behind it, for each distance less one.
shared float unionArea[kReach * kGroup];

// Returns the neighbour of the invocation's cluster whose union with it has the least area. Of equals, the cluster
// prefers the one at the position with the last bit flipped, so that equal clusters choose each other.
uint findNearest(uint count) {
    uint t = gl_LocalInvocationIndex;
    float behind[kReach];
    Box box = clusterBox(t);
    [[unroll]] for (uint step_ = 1u; step_ <= kReach; ++step_) {
        behind[step_ - 1u] = t + step_ < count ? unionAreaOf(box, clusterBox(t + step_)) : kFar;
        unionArea[(step_ - 1u) * kGroup + t] = behind[step_ - 1u];
    }
    barrier();
    bool isFlippedBehind = (t & 1u) == 0u && t + 1u < count;
    uint best = isFlippedBehind ? t + 1u : t - 1u;
    float least = isFlippedBehind || t == 0u ? behind[0] : unionArea[t - 1u];
    [[unroll]] for (uint step_ = 1u; step_ <= kReach; ++step_) {
        float before_ = t >= step_ ? unionArea[(step_ - 1u) * kGroup + t - step_] : kFar;
        if (before_ < least) {
            least = before_;
            best = t - step_;
        }
        if (behind[step_ - 1u] < least) {
            least = behind[step_ - 1u];
            best = t + step_;
        }
    }
    return t < count ? best : t;
}

// Makes a node of two clusters.
Cluster merged(Cluster one, Cluster two) {
    uint node = min(one.last, two.last);
    Quads to = Quads(nodeAt(node));
    to.quad[0] = uvec4(floatBitsToUint(one.box.lo), one.reference);
    to.quad[1] = uvec4(floatBitsToUint(one.box.hi), two.reference);
    to.quad[2] = uvec4(floatBitsToUint(two.box.lo), one.shape);
    to.quad[3] = uvec4(floatBitsToUint(two.box.hi), two.shape);
    Cluster both = Cluster(join(one.box, two.box), node, above(one.shape, two.shape), max(one.last, two.last),
                           one.count + two.count);
    primitiveCounts().word[node] = both.count;
    return both;
}

// Merges clusters that are nearest to each other, unless the union is higher than allowed. If there are none, merges
// every two clusters. Returns the number of clusters that are left.
uint mergePairs(uint count, uint highest, bool byPosition) {
    uint t = gl_LocalInvocationIndex;
    bool exists = t < count;
    uint other = byPosition ? t : findNearest(count);
    nearest[t] = other;
    barrier();
    bool isPair = exists && !byPosition && nearest[other] == t;
    isPair = isPair && heightOf(above(clusterRest[t].y, clusterRest[other].y)) <= highest;
    uint staying = bitsOf(exists && !(isPair && other < t));
    if (bitCount(staying) == count) {
        other = t ^ 1u;
        isPair = exists && other < count;
        staying = 0x55555555u & kNone >> kGroup - count;
    }
    bool stays = (staying >> t & 1u) != 0u;
    Cluster own;
    Costs costs;
    if (stays) {
        own = clusterAt(t);
        if (isDecided()) costs = costsAt(t);
        if (isPair) {
            own = merged(own, clusterAt(other));
            if (isDecided()) costs = decide(own.reference, areaOf(own.box), own.shape, costs, costsAt(other));
        }
    }
    barrier();
    if (stays) {
        putCluster(bitsBelow(staying), own);
        if (isDecided()) putCosts(bitsBelow(staying), costs);
    }
    barrier();
    return bitCount(staying);
}

void writeHeader(uint leaves, uint root) {
    Quads to = Quads(job.blob);
    uint geometries = job.leafKind == kInstances ? 0u : job.inputCount;
    to.quad[0] = uvec4(kBinary, job.leafKind, root, state().word[kActive]);
    to.quad[1] = uvec4(job.nodes, job.primitives, job.vertices, job.geometries);
    to.quad[2] = uvec4(leaves == 0u ? 0u : leaves - 1u, geometries, 0u, job.headerFlags);
    for (uint k = 3u; k < 8u; ++k) to.quad[k] = uvec4(0);
}

// Starts the wide nodes with the root. The first words of each are the binary node that it is built from, and the slot
// of its first primitive.
void writeWideRoot(uint leaves, uint root) {
    const uint kOneLeaf = 3u;
    if (job.wideCapacity == 0u || leaves <= kOneLeaf) return;
    Words first = Words(place(job.nodes));
    first.word[0] = root;
    first.word[1] = 0u;
    state().word[kWideNodes] = 1u;
    state().word[kEnds] = 1u;
}

// Writes the header of a tree that is complete.
void finishTree(uint leaves, Cluster root) {
    writeHeader(leaves, root.reference);
    Corners to = Corners(plus(job.blob, 48u, 0u));
    to.corner[0] = root.box.lo;
    to.corner[1] = root.box.hi;
    header().word[18] = heightOf(root.shape);
    writeWideRoot(leaves, root.reference);
}

// Merges the clusters of a range. Heights are limited so that the ranges above can merge by position, one round each,
// and the last one five rounds.
void mergeRange(uvec3 range, uint leaves) {
    uint t = gl_LocalInvocationIndex;
    bool isWhole = range.z - range.x + 1u == leaves;
    uint above_ = isWhole ? 0u : 5u + sharedBits(range.x, range.z);
    uint count = joinHalves(range);
    [[dont_unroll]] for (uint round_ = 0u; count > (isWhole ? 1u : kStaying); ++round_) {
        uint later = isWhole ? uint(findMSB(count - 1u)) + 1u : above_;
        count = mergePairs(count, kHighest - min(later, kHighest), round_ >= kRounds);
    }
    if (isWhole) {
        if (t == 0u) finishTree(leaves, clusterAt(0u));
    } else if (t < kStaying) {
        Words to = stayingClusters();
        to.word[2u * (range.x + t)] = t < count ? clusterRest[t].x : kNone;
        to.word[2u * (range.x + t) + 1u] = clusterRest[t].z;
    }
    meet();
}

// Walks up from a range of leaves. Returns the first leaf of the second half of a range of many leaves, or kNone if an
// invocation from the other half goes on.
uint climb(inout uint first, inout uint last, uint leaves) {
    uint before_ = first == 0u ? 0u : sharedBits(first - 1u, first);
    uint behind = last + 1u == leaves ? 0u : sharedBits(last, last + 1u);
    while (true) {
        bool isFirst = first == 0u || (last + 1u < leaves && behind > before_);
        uint gap = isFirst ? last : first - 1u;
        // Publishes the clusters of the range, which the workgroup wrote before its last barrier.
        if (last - first >= kStaying) memoryBarrierBuffer();
        uint end = atomicExchange(Words(work(job.arrivals)).word[gap], isFirst ? first : last);
        if (end == kNone) return kNone;
        if (isFirst) last = end; else first = end;
        if (last - first >= kStaying || last - first + 1u == leaves) {
            memoryBarrierBuffer();
            return gap + 1u;
        }
        if (isFirst) {
            behind = last + 1u == leaves ? 0u : sharedBits(last, last + 1u);
        } else {
            before_ = first == 0u ? 0u : sharedBits(first - 1u, first);
        }
    }
}

void clusterFrom(uint leaf) {
    uint leaves = state().word[kActive];
    uint t = gl_LocalInvocationIndex;
    if (leaf == 0u && leaves < 2u) {
        uint root = leaves == 0u ? kNone : leafReference(0u);
        finishTree(leaves, Cluster(leafBox(root), root, 0u, 0u, 0u));
    }
    uint first = leaf, last = leaf;
    bool goes = leaf < leaves && leaves > 1u;
    while (true) {
        if (t == 0u) arrived = 0u;
        barrier();
        if (goes) {
            uint second = climb(first, last, leaves);
            goes = second != kNone;
            if (goes) {
                reached[t] = uvec3(first, second, last);
                atomicOr(arrived, 1u << t);
            }
        }
        meet();
        uint waiting = arrived;
        if (waiting == 0u) return;
        [[dont_unroll]] while (waiting != 0u) {
            mergeRange(reached[findLSB(waiting)], leaves);
            waiting &= waiting - 1u;
        }
        goes = goes && last - first + 1u != leaves;
    }
}
