// The primitives of leaves, as the caller's buffers hold them now.
void main() {
    job = jobs.job[firstJob];
    refitFrom(invocation());
}
