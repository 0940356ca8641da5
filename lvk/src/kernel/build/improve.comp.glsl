// The boxes of binary nodes, and better places for some of them.
void main() {
    job = jobs.job[firstJob];
    fitFrom(invocation());
}
