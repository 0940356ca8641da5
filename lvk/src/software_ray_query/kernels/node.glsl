// Binary nodes: minimum and maximum of both children in turn, beside them their references and shapes.
struct Node { uvec4 part[4]; };

// Bounds and shape of a child.
struct Fitted { Box box; uint shape; };

// The shape of a subtree, in one word: nodes on its longest path (8 bits), groups (8 bits), and primitives (16 bits).
// Groups are the parts after splits until none exceeds a leaf of a wide node. Each number saturates.
const uint kMostOfGroup = 3u;
const uint kLeafShape = 0x00010100u;

uint heightOf(uint shape) { return shape & 0xffu; }

uint groupsOf(uint shape) { return shape >> 8 & 0xffu; }

uint countOf(uint shape) { return shape >> 16; }

bool isGroup(uint shape) { return countOf(shape) <= kMostOfGroup; }

// Returns the shape of a node of two children.
uint above(uint one, uint two) {
    uint count = min(countOf(one) + countOf(two), 0xffffu);
    uint groups = count <= kMostOfGroup ? 1u : min(groupsOf(one) + groupsOf(two), 0xffu);
    return max(heightOf(one), heightOf(two)) + 1u | groups << 8 | count << 16;
}

uvec2 nodeAt(uint node) { return element(job.binary, node, 64u); }

Node readNode(uint node) {
    Quads from = Quads(nodeAt(node));
    return Node(uvec4[4](from.quad[0], from.quad[1], from.quad[2], from.quad[3]));
}

uint referenceOf(Node node, uint which) { return which == 0u ? node.part[0].w : node.part[1].w; }

Fitted childOf(Node node, uint which) {
    uvec3 lo = which == 0u ? node.part[0].xyz : node.part[2].xyz;
    uvec3 hi = which == 0u ? node.part[1].xyz : node.part[3].xyz;
    uint shape = which == 0u ? node.part[2].w : node.part[3].w;
    return Fitted(Box(uintBitsToFloat(lo), uintBitsToFloat(hi)), shape);
}

// Writes nothing of the other child, which another invocation may write at the same time.
void writeChild(uint node, uint which, Fitted child) {
    uvec2 at = nodeAt(node);
    Corners(plus(at, which * 32u, 0u)).corner[0] = child.box.lo;
    Corners(plus(at, which * 32u + 16u, 0u)).corner[0] = child.box.hi;
    Words(at).word[11 + which * 4] = child.shape;
}

bool isLeaf(uint reference) { return (reference & kLeaf) != 0u; }

void fitLeaf(uint node, uint which, uint reference) { writeChild(node, which, Fitted(leafBox(reference), kLeafShape)); }
