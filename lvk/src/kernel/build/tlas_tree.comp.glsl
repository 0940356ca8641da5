// The hierarchy of instances; those stand where they were read.
void main() {
    job = jobs.job[firstJob];
    writeHierarchy(invocation());
}
