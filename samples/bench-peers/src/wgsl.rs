//! WGSL of the rows. The declarations of resources differ between the libraries, and precede these texts.

/// Draws with constants `push.words`: all corners lie at one point.
pub(crate) const PUSH: &str = "
    @vertex fn corner() -> @builtin(position) vec4f { return vec4f(f32(push.words[0].x) + 1.0); }
    @fragment fn shade() -> @location(0) vec4f { return vec4f(push.words[0]); }";

/// Adds 1 to each of `numbers`.
pub(crate) const COUNT: &str = "
    @compute @workgroup_size(64) fn count(@builtin(global_invocation_id) id: vec3u) { numbers[id.x] += 1u; }";

/// The cell of a texture by `push.number` and `push.side`, and the first texel of `picture`.
pub(crate) const TEXTURED: &str = "
    @vertex fn corner(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
        let corner = vec2u(index & 1u, index >> 1u);
        let cell = vec2u(push.number % (push.side / 2u), push.number / (push.side / 2u));
        let place = vec2f(2u * (cell + corner)) / f32(push.side) * 2.0 - 1.0;
        return vec4f(place, 0.0, 1.0);
    }
    @fragment fn shade() -> @location(0) vec4f { return textureLoad(picture, vec2i(0), 0); }";

/// Types of the frame of rays.
pub(crate) const RAY_TYPES: &str = "
    enable wgpu_ray_query;
    struct View { eye: vec4f, right: vec4f, down: vec4f, forward: vec4f };
    struct Hit { t: f32, primitive: u32 };";

/// Primary rays with the camera `view` through `scene`; writes `hits`.
pub(crate) const RAYS: &str = "
    @compute @workgroup_size(8, 8) fn trace(@builtin(global_invocation_id) id: vec3u) {
        let size = vec2u(u32(view.eye.w), u32(view.right.w));
        if id.x >= size.x || id.y >= size.y { return; }
        let place = (vec2f(id.xy) + 0.5) / vec2f(size) * 2.0 - 1.0;
        let direction = normalize(view.forward.xyz + place.x * view.right.xyz + place.y * view.down.xyz);
        var rq: ray_query;
        rayQueryInitialize(&rq, scene, RayDesc(1u, 0xffu, 0.0, 1e30, view.eye.xyz, direction));
        while rayQueryProceed(&rq) {}
        let found = rayQueryGetCommittedIntersection(&rq);
        var hit = Hit(-1.0, 0u);
        if found.kind == RAY_QUERY_INTERSECTION_TRIANGLE { hit = Hit(found.t, found.primitive_index); }
        hits[id.y * size.x + id.x] = hit;
    }";
