// Barrier: makes writes of all invocations visible to the workgroup.
void meet() {
    groupMemoryBarrier();
    barrier();
}
