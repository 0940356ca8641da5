// Binary nodes: corners of both children in turn, and beside them what the children are and how high they are.
struct Node { uvec4 part[4]; };

// A child's box and the nodes on the longest path below it.
struct Fitted { Box box; uint height; };

uvec2 nodeAt(uint node) { return element(place(job.nodes), node, 64u); }

Node readNode(uint node) {
    Quads from = Quads(nodeAt(node));
    return Node(uvec4[4](from.quad[0], from.quad[1], from.quad[2], from.quad[3]));
}

uint referenceOf(Node node, uint which) { return which == 0u ? node.part[0].w : node.part[1].w; }

Fitted childOf(Node node, uint which) {
    uvec3 lo = which == 0u ? node.part[0].xyz : node.part[2].xyz;
    uvec3 hi = which == 0u ? node.part[1].xyz : node.part[3].xyz;
    uint height = which == 0u ? node.part[2].w : node.part[3].w;
    return Fitted(Box(uintBitsToFloat(lo), uintBitsToFloat(hi)), height);
}

// Touches nothing of the other child: that may be written at the same time.
void writeChild(uint node, uint which, Fitted child) {
    uvec2 at = nodeAt(node);
    Corners(plus(at, which * 32u, 0u)).corner[0] = child.box.lo;
    Corners(plus(at, which * 32u + 16u, 0u)).corner[0] = child.box.hi;
    Words(at).word[11 + which * 4] = child.height;
}

bool isLeaf(uint reference) { return (reference & kLeaf) != 0u; }

void fitLeaf(uint node, uint which, uint reference) { writeChild(node, which, Fitted(leafBox(reference), 0u)); }
