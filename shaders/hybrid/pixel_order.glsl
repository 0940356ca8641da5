// An order of the pixels in which those whose rays go on come first.
#ifndef HYBRID_PIXEL_ORDER
#define HYBRID_PIXEL_ORDER

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer PixelOrder {
    uint firsts; // pixels that go on, from the front
    uint others; // and the others, from the back
    uint at[]; // x in the low, y in the high half
};

#endif
