// A build up to its sorted codes, with one workgroup for each job: dispatches cost more than the work of few primitives.
void boundAll() {
    uint actives = 0;
    Box centres = emptyBox();
    [[dont_unroll]] for (uint i = gl_LocalInvocationIndex; i < job.count; i += kGroup) {
        centres = join(centres, keepBox(i, smallBox(i), actives));
    }
    extendBounds(centres, actives);
}

void sortAll() {
    uint each = (job.count + kGroup - 1) / kGroup;
    uint first = min(gl_LocalInvocationIndex * each, job.count);
    uint end = min(first + each, job.count);
    [[dont_unroll]] for (uint pass = 0; pass < passes(); ++pass) {
        Source from = sourceOf(pass);
        Words to = targetOf(pass);
        resetCounts();
        [[dont_unroll]] for (uint i = first; i < end; ++i) countOne(digitOf(from, i));
        rankFirsts();
        [[dont_unroll]] for (uint i = first; i < end; ++i) moveKey(from, to, i, nextRank(digitOf(from, i)));
        meet();
    }
}

void main() {
    if (groupNumber() >= passOrJobs) return;
    readJob(firstJob + groupNumber());
    uint t = gl_LocalInvocationIndex;
    if (t < kStateWords) state().word[t] = 0u;
    meet();
    boundAll();
    meet();
    [[dont_unroll]] for (uint i = t; i < job.count; i += kGroup) writeKey(i);
    meet();
    sortAll();
}
