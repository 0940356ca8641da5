// A square that covers a sphere exactly as far as the cone of rays that meet it: it touches the sphere where it is
// nearest to the eye, so nothing of the sphere lies in front of the square, and an early depth test with it is safe.
// Instances count from the first ball on, so glass begins at the instance `ballCount`.
#include "hybrid_oit/frame.glsl"

layout(location = 0) flat out uint outSphere;

const vec2 kCorners[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1), vec2(-1, 1));
// Keeps pixels on the silhouette from being lost to rounding.
const float kMargin = 1.001;

void main() {
    outSphere = uint(gl_InstanceIndex);
    Sphere sphere = frame.spheres.at[outSphere];
    vec3 toCenter = sphere.center - frame.camera.eye;
    float distance = length(toCenter);
    vec3 forward = toCenter / distance;
    float tangent = sphere.radius * inversesqrt(max(distance * distance - sphere.radius * sphere.radius, 1e-6));
    float near = distance - sphere.radius;
    vec3 right = normalize(cross(forward, abs(forward.y) < 0.99 ? vec3(0, 1, 0) : vec3(1, 0, 0)));
    vec2 corner = kCorners[gl_VertexIndex] * (near * tangent * kMargin);
    vec3 position = frame.camera.eye + near * forward + corner.x * right + corner.y * cross(right, forward);
    gl_Position = cameraClip(frame.camera, position);
}
