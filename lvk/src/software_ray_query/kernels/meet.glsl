// All invocations of the workgroup see what each of them wrote.
void meet() {
    memoryBarrierBuffer();
    barrier();
}
