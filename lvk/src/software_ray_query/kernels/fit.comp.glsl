// Fits the bounds of binary nodes.
void main() {
    readJob(firstJob);
    fitFrom(invocation());
}
