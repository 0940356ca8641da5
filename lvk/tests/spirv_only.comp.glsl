layout(local_size_x = 64) in;
layout(buffer_reference, scalar) writeonly buffer Words { uint at[]; };
layout(push_constant, scalar) uniform Push { Words words; uint count; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < count) {
        words.at[i] = i * i + 7u;
    }
}
