// Writes the key of every primitive, and resets the counts of digits.
void main() {
    readJob(firstJob);
    uint i = invocation();
    if (i < job.count) writeKey(i);
    if (i < kDigitTotals) Words(work(job.digits)).word[i] = 0u;
}
