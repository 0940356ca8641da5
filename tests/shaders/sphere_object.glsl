// Spheres in object space, within the AABBs of the test. SPHERE_STEP and SPHERE_COUNT, which have no common divisor, put
// neighbours far from each other in the list.
#ifndef SPHERE_OBJECT
#define SPHERE_OBJECT

#ifndef SPHERE_STEP
#define SPHERE_STEP 1
#define SPHERE_COUNT 0x7fffffff
#endif

vec3 sphereCenter(int geometry, int primitive) {
    int place = primitive * SPHERE_STEP % SPHERE_COUNT;
    return vec3(place % 3, place / 3, geometry) * 2.0;
}

// Both crossings of a ray with the surface; false if the ray misses the sphere.
bool crossSphere(vec3 center, float radius, vec3 origin, vec3 direction, out vec2 places) {
    vec3 toCenter = center - origin;
    float middle = dot(toCenter, direction) / dot(direction, direction);
    vec3 passing = toCenter - direction * middle;
    float room = radius * radius - dot(passing, passing);
    float halfway = sqrt(max(room, 0.0) / dot(direction, direction));
    places = vec2(middle - halfway, middle + halfway);
    return room > 0.0;
}

#endif
