// Keeps the children of a node.
uint rotate(uint number, Node node) { return above(node.part[2].w, node.part[3].w); }
