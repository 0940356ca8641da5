// Bounds of the content of leaves.
Box cornersBox(vec3 a, vec3 b, vec3 c) {
    if (!(isFinite(a) && isFinite(b) && isFinite(c))) return emptyBox();
    return around(a, b, c);
}

Box keptBox(uint slot) {
    if (job.leafKind == kBoxes) {
        Quads kept = slotAt(slot, 32u);
        Box box = Box(uintBitsToFloat(kept.quad[0].xyz), uintBitsToFloat(kept.quad[1].xyz));
        return isNumber(box.lo) && isNumber(box.hi) && all(lessThanEqual(box.lo, box.hi)) ? box : emptyBox();
    }
    if (job.leafKind == kTriangles) {
        Quads kept = slotAt(slot, 48u);
        return cornersBox(uintBitsToFloat(kept.quad[0].xyz), uintBitsToFloat(kept.quad[1].xyz),
                          uintBitsToFloat(kept.quad[2].xyz));
    }
    uvec3 named = namedVertices(slot);
    Corners vertices = Corners(place(job.vertices));
    return cornersBox(vertices.corner[named.x], vertices.corner[named.y], vertices.corner[named.z]);
}
