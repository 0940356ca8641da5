// The push constants of an interface.

// Vertices as egui has them: position in points, position in the texture, colour multiplied with its alpha, sRGB.
struct UiVertex {
    vec2 position;
    vec2 uv;
    uint color;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer UiVertices { UiVertex at[]; };

layout(push_constant, scalar) uniform Push {
    UiVertices vertices;
    vec2 clipPerPoint;
    uint tex;
    uint smp;
    uint flags; // 1: the target holds linear light; 2: the texels are linear light
};
