// The visible triangle of each pixel, and intermediate data of the two rasterisers that find it.
#ifndef HYBRID_VISIBILITY_BUFFERS
#define HYBRID_VISIBILITY_BUFFERS

// A 64-bit word a pixel, row by row: x has the bits of the triangle inverted, y those of its distance. So the smaller
// word is the nearer triangle. Without a triangle both are kNoTriangle; where x is kAskRay, rounding decides what the
// pixel shows, and so its ray must say.
layout(buffer_reference, scalar, buffer_reference_align = 8) buffer VisibilityWords { uvec2 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer UintArray { uint at[]; };

struct Visibility {
    VisibilityWords words; // by the compute rasteriser
    uvec2 setTriangles; // addresses of its SetTriangles
    uvec2 tiles; // and of its Tiles
    UintArray survivorBits; // of the hardware rasteriser's culling: a bit a triangle
    UintArray survivorCounts; // for each workgroup
    UintArray survivorIndices; // three vertices a survivor
    UintArray survivors; // numbers of the triangles
    UintArray draw; // arguments of the indirect draw
    uint image; // index into kTextures2D, or kNoImage where `words` counts
    uint triangleCount;
    uint setCapacity; // of these
    uint tileCapacity;
};

const uint kAskRay = 0u;
const uint kNoImage = 0xffffffffu;

#endif
