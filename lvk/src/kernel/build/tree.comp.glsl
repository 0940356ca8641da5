// The hierarchy, and everything else of the structure but its boxes.
void main() {
    readJob(firstJob);
    writeTree(invocation());
}
