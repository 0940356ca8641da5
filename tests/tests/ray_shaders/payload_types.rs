//! Payloads and callable data whose types are declared in other words on both sides, on every path.

use lvk::{HitGroup, RayTracingPipelineDesc, Result, ShaderStage};
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;
use lvk_tests::shader_groups::{Counts, GroupScene};

/// The words of both sides: `Value` is the type, `GET(v)` the number in the value `v`, and `SET(v, n)` makes it `n`.
struct Types {
    name: &'static str,
    caller: &'static str,
    called: &'static str,
}

const UINT: &str = "#define Value uint\n#define GET(v) v\n#define SET(v, n) v = n";

const NODES: &str = "
    layout(buffer_reference) buffer Node;
    layout(buffer_reference, scalar) buffer Node { uint word; Node next; };
    struct Value { Node node; uint number; };
    #define GET(v) v.number
    #define SET(v, n) v.number = n";

const TYPES: [Types; 8] = [
    Types { name: "the same", caller: UINT, called: UINT },
    Types {
        name: "signed and unsigned",
        caller: UINT,
        called: "#define Value int\n#define GET(v) uint(v)\n#define SET(v, n) v = int(n)",
    },
    Types {
        name: "floats and their bits",
        caller: "#define Value vec2\n#define GET(v) floatBitsToUint(v.y)\n#define SET(v, n) v.y = uintBitsToFloat(n)",
        called: "#define Value uvec2\n#define GET(v) v.y\n#define SET(v, n) v.y = n",
    },
    Types {
        name: "arrays in structs",
        caller: "struct Value { vec3 color; uint many[3]; };\n#define GET(v) v.many[2]\n#define SET(v, n) v.many[2] = n",
        called: "struct Value { ivec3 color; int many[3]; };
                 #define GET(v) uint(v.many[2])\n#define SET(v, n) v.many[2] = int(n)",
    },
    Types {
        name: "pointers to buffers of other qualifiers",
        caller: "layout(buffer_reference, scalar) buffer Table { uint at[]; };
                 struct Value { Table table; uint number; };\n#define GET(v) v.number\n#define SET(v, n) v.number = n",
        called: "layout(buffer_reference, scalar) readonly buffer Table { uint at[]; };
                 struct Value { Table table; uint number; };\n#define GET(v) v.number\n#define SET(v, n) v.number = n",
    },
    Types {
        name: "arrays with a length of specialization constants",
        caller: "layout(constant_id = 3) const uint N = 2;
                 struct Value { uint many[N + 1]; };\n#define GET(v) v.many[N]\n#define SET(v, n) v.many[N] = n",
        called: "layout(constant_id = 3) const uint N = 2;
                 struct Value { uint many[2 * N - 1]; };\n#define GET(v) v.many[N]\n#define SET(v, n) v.many[N] = n",
    },
    Types {
        name: "arrays with a length of a vector of specialization constants",
        caller: "layout(constant_id = 3) const uint N = 2;
                 const uvec2 SIZE = uvec2(N > 1 ? 4 : 2, N);
                 struct Value { uint many[SIZE.x]; };\n#define GET(v) v.many[3]\n#define SET(v, n) v.many[3] = n",
        called: "struct Value { uint many[4]; };\n#define GET(v) v.many[3]\n#define SET(v, n) v.many[3] = n",
    },
    Types { name: "pointers to buffers that contain such pointers", caller: NODES, called: NODES },
];

const RAY_GEN: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(location = 0) rayPayloadEXT Value value;
    layout(location = 1) callableDataEXT Value data;
    void main() {
        uint i = gl_LaunchIDEXT.x;
        SET(value, 7u);
        SET(data, 7u);
        if (i < hits + misses) {
            vec3 direction = vec3(0, 0, i < hits ? 1 : -1);
            traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction, 10.0, 0);
            results.at[i] = GET(value);
        } else {
            executeCallableEXT(0, 1);
            results.at[i] = GET(data);
        }
    }";

#[test]
fn values_of_the_same_bits_are_passed_on() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let scene = GroupScene::new(&ctx)?;
        for Types { name, caller, called } in TYPES {
            let answer = |stage, variable: &str, number: u32| {
                let text = format!(
                    "{called}\nlayout(location = 0) {variable} Value value; void main() {{ SET(value, GET(value) * 10u + {number}u); }}"
                );
                shader(&ctx, stage, &text)
            };
            let ray_gen = shader(&ctx, ShaderStage::RayGen, &format!("{caller}\n{RAY_GEN}"))?;
            let hit = answer(ShaderStage::ClosestHit, "rayPayloadInEXT", 2)?;
            let miss = answer(ShaderStage::Miss, "rayPayloadInEXT", 1)?;
            let callable = answer(ShaderStage::Callable, "callableDataInEXT", 3)?;
            let pipeline = ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
                ray_gen: &[*ray_gen],
                miss: &[*miss],
                hit_groups: &[HitGroup { closest_hit: Some(*hit), ..Default::default() }],
                callable: &[*callable],
                ..Default::default()
            })?;
            let counts = Counts { hits: 1, misses: 1, callables: 1 };
            assert_eq!(scene.run(*pipeline, 0, counts)?, [72, 71, 73], "{path:?}, {name}");
        }
    }
    Ok(())
}
