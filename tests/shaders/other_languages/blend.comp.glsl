// Stores a texture multiplied by colours from a buffer.
layout(local_size_x = 8, local_size_y = 8) in;

layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer Colors {
    vec4 at[];
};

layout(push_constant, scalar) uniform Push {
    Colors colors;
    uint tex;
    uint smp;
    uint image;
    uvec2 size;
};

void main() {
    uvec2 texel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(texel, size))) {
        return;
    }
    vec2 uv = (vec2(texel) + 0.5) / vec2(size);
    vec4 color = textureBindless2DLod(tex, smp, uv, 0.0) * colors.at[texel.x];
    imageStore(kImages2D[image], ivec2(texel), color);
}
