// Decides which binary nodes become wide nodes, at the least cost. The cost of a subtree for a share follows from those
// of its two halves.

// Costs of a primitive's test and of a node, for each unit of area. A node costs more than rays take for it, so that
// nodes are full. Products of these numbers and small integers are exact.
const float kPrimitiveCost = 0.3125;
const float kNodeCost = 2.0;

// Cost of what is not allowed. The sum of two is finite.
const float kNever = 1e38;

// A subtree of at most this many groups becomes no node of its own: its groups become leaves of the node above. So few
// nodes have few children, and all nodes fit.
const uint kFewGroups = 3u;

// The least cost of a subtree for each share.
struct Costs { float of[kShares]; };

Costs costsOf(uint reference, float area) {
    Costs costs;
    if ((reference & kLeaf) != 0u) {
        [[unroll]] for (uint share = 0u; share < kShares; ++share) costs.of[share] = area * kPrimitiveCost;
        return costs;
    }
    uvec4 low = decisionAt(reference).quad[0], high = decisionAt(reference).quad[1];
    vec4 few = uintBitsToFloat(low);
    vec3 many = uintBitsToFloat(high.xyz);
    [[unroll]] for (uint share = 0u; share < 4u; ++share) costs.of[share] = few[share];
    [[unroll]] for (uint share = 4u; share < kShares; ++share) costs.of[share] = many[share - 4u];
    return costs;
}

// Decides for a node of this area and shape, whose halves have these costs. Returns the costs of the node.
Costs decide(uint node, float area, uint shape, Costs one, Costs other) {
    float least[kShares];
    uint first[kShares];
    [[unroll]] for (uint both = 0u; both < kShares; ++both) {
        least[both] = one.of[0] + other.of[both];
        first[both] = 0u;
        [[unroll]] for (uint share = 1u; share <= both; ++share) {
            float sum = one.of[share] + other.of[both - share];
            if (sum < least[both]) {
                least[both] = sum;
                first[both] = share;
            }
        }
    }
    bool isFew = groupsOf(shape) <= kFewGroups;
    float whole = least[6] + area * kNodeCost;
    if (isFew) whole = isGroup(shape) ? area * kPrimitiveCost * float(countOf(shape)) : kNever;
    uint decision = first[6];
    Costs all_;
    all_.of[0] = whole;
    [[unroll]] for (uint share = 1u; share < kShares; ++share) {
        bool isLess = least[share - 1u] < all_.of[share - 1u];
        all_.of[share] = min(isLess ? least[share - 1u] : all_.of[share - 1u], kNever);
        decision |= (isLess ? first[share - 1u] : kAsBelow) << share * 3u;
    }
    decisionAt(node).quad[0] = floatBitsToUint(vec4(all_.of[0], all_.of[1], all_.of[2], all_.of[3]));
    decisionAt(node).quad[1] = uvec4(floatBitsToUint(vec3(all_.of[4], all_.of[5], all_.of[6])), decision);
    return all_;
}
