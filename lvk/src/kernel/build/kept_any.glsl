// Boxes of what leaves hold.
Box cornersBox(vec3 a, vec3 b, vec3 c) {
    if (!(isFinite(a) && isFinite(b) && isFinite(c))) return emptyBox();
    return Box(min(a, min(b, c)), max(a, max(b, c)));
}

Box keptBox(uint slot) {
    Floats kept = Floats(place(job.primitives));
    if (job.leafKind == kInstances) return readBox(Floats(work(job.boxes)), slot * 6);
    if (job.leafKind == kTriangles) {
        uint at = slot * kTriangleWords;
        return cornersBox(readVec3(kept, at), readVec3(kept, at + 4), readVec3(kept, at + 8));
    }
    if (job.leafKind == kIndexedTriangles) {
        Words corners = Words(place(job.primitives));
        Floats vertices = Floats(place(job.vertices));
        uint at = slot * kIndexedWords;
        return cornersBox(readVec3(vertices, corners.word[at] * 3), readVec3(vertices, corners.word[at + 1] * 3),
                          readVec3(vertices, corners.word[at + 2] * 3));
    }
    uint at = slot * kBoxWords;
    Box box = Box(readVec3(kept, at), readVec3(kept, at + 4));
    return isNumber(box.lo) && isNumber(box.hi) && all(lessThanEqual(box.lo, box.hi)) ? box : emptyBox();
}
