// Visibility by the hardware rasteriser: the number of the triangle.
#include "hybrid/frame.glsl"

layout(location = 0) out uint outTriangle;

void main() {
    outTriangle = frame.visibility.survivors.at[gl_PrimitiveID];
}
