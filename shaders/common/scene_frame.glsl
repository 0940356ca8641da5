// The members of `Frame` that samples share which trace rays in a lit scene. Included inside of the block.
    Camera camera;
    Scene scene;
    Light lights[2];
    vec3 ambientAbove;
    uint lightCount;
    vec3 ambientBelow;
    float offsetExtent; // see ray_offset.glsl
    uint tlas;
    uint sky; // index into kTexturesCube
    uint surfaceSampler;
    uint skySampler;
