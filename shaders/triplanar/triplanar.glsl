// Textures without texture coordinates: one projected along each axis, mixed by where the surface faces.
#include "triplanar/frame.glsl"

vec3 texel(uint number, vec2 at) {
    // Pictures have their first row at the top.
    return textureBindless2D(frame.textures[number], frame.smp, vec2(0.5 * at.x, -0.5 * at.y)).rgb;
}

vec3 byPlanes(Body body, vec3 position, vec3 normal) {
    vec3 weights = pow(abs(normal), vec3(frame.sharpness));
    weights /= weights.x + weights.y + weights.z;
    return weights.x * texel(body.sides, position.zy) + weights.y * texel(normal.y > 0.0 ? body.top : body.sides, position.xz) +
        weights.z * texel(body.sides, position.xy);
}

// Texture coordinates by longitude and latitude, as models often have: stretched, and with seams and poles.
vec3 byAngles(Body body, vec3 position, vec3 normal) {
    vec2 angles = vec2(atan(position.z, position.x), asin(normalize(position).y));
    return texel(body.sides, 1.2732395 * angles);
}
