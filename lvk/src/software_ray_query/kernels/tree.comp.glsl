// The hierarchy.
void main() {
    readJob(firstJob);
    writeHierarchy(invocation());
}
