// The hierarchy of instances; those stand where they were read.
void main() {
    readJob(firstJob);
    writeHierarchy(invocation());
}
