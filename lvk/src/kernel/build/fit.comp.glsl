// The boxes of binary nodes.
void main() {
    job = jobs.job[firstJob];
    fitFrom(invocation());
}
