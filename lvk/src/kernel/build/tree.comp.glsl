// The hierarchy, and everything else of the structure but its boxes.
void main() {
    job = jobs.job[firstJob];
    writeTree(invocation());
}
