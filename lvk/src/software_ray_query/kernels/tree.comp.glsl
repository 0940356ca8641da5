// Builds the hierarchy.
void main() {
    readJob(firstJob);
    writeHierarchy(invocation());
}
