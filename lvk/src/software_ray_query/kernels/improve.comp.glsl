// Fits the bounds of binary nodes, and improves the tree by rotations.
void main() {
    readJob(firstJob);
    fitFrom(invocation());
}
