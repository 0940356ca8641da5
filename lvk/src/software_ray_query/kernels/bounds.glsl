// Reduces the bounds of the centres of all primitives, first of a workgroup, then of all.
shared vec3 groupLo[128];
shared vec3 groupHi[128];
shared uint groupActive[128];

void extendBounds(Box centres, uint actives) {
    uint t = gl_LocalInvocationIndex;
    groupLo[t] = centres.lo;
    groupHi[t] = centres.hi;
    groupActive[t] = actives;
    [[dont_unroll]] for (uint half_ = kGroup / 2; half_ > 0; half_ /= 2) {
        barrier();
        if (t < half_) {
            groupLo[t] = min(groupLo[t], groupLo[t + half_]);
            groupHi[t] = max(groupHi[t], groupHi[t + half_]);
            groupActive[t] += groupActive[t + half_];
        }
    }
    if (t == 0 && groupActive[0] > 0) {
        uvec3 lo = ~ordered(groupLo[0]);
        uvec3 hi = ordered(groupHi[0]);
        Words all_ = state();
        [[dont_unroll]] for (uint axis = 0; axis < 3; ++axis) {
            atomicMax(all_.word[axis], lo[axis]);
            atomicMax(all_.word[3 + axis], hi[axis]);
        }
        atomicAdd(all_.word[kActive], groupActive[0]);
    }
}

// Stores the bounds of a primitive and returns its centre as bounds; empty if the primitive is inactive.
Box keepBox(uint i, Box box, inout uint actives) {
    writeBox(Corners(work(job.boxes)), i, box);
    if (isEmpty(box)) return box;
    actives += 1;
    vec3 c = centre(box);
    return Box(c, c);
}
