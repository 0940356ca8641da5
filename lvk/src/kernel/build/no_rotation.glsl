// A node keeps its children.
uint rotate(uint node) { return max(nodeAt(node).word[11], nodeAt(node).word[15]) + 1; }
