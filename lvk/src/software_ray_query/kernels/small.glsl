// A build up to its binary tree, with one workgroup for each job: dispatches cost more than the work of few primitives.
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
        rankKeys(from, first, end);
        [[dont_unroll]] for (uint i = first; i < end; ++i) {
            uint rank = counts[digitOf(from, i) * kGroup + gl_LocalInvocationIndex]++;
            moveKey(from, to, i, rank);
        }
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
    [[dont_unroll]] for (uint i = t; i < max(job.count, 1u); i += kGroup) writeHierarchy(i);
    meet();
    [[dont_unroll]] for (uint round_ = 1;; ++round_) {
        [[dont_unroll]] for (uint i = t; i < max(job.nodeCapacity, 1u); i += kGroup) fitFrom(i);
        if (round_ == max(job.improvements, 1u)) return;
        meet();
        [[dont_unroll]] for (uint i = t; i < min(header().word[8], job.nodeCapacity); i += kGroup) resetArrivals(i);
        meet();
    }
}
