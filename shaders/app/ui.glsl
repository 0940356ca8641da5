// The push constants of the user interface.

// Corners as egui has them: place in points, place in the texture, colour multiplied with its alpha, sRGB.
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
    uint linearTarget; // 1 where the target encodes linear light by itself
};
