//! Payloads and callable data whose types are declared in other words on both sides, on every path.

use lvk::{HitGroup, RayTracingPipelineDesc, Result, ShaderStage};
use lvk_tests::pipeline_paths::pipeline_devices;
use lvk_tests::ray_tracer::shader;
use lvk_tests::shader_groups::{Counts, GroupScene};

/// The words of both sides: `Value` is the type, `GET` the number in a value, `SET` a value with the number `n`.
struct Types {
    name: &'static str,
    caller: &'static str,
    called: &'static str,
}

const UINT: &str = "#define Value uint\n#define GET value\n#define SET(n) value = n";

const NODES: &str = "
    layout(buffer_reference) buffer Node;
    layout(buffer_reference, scalar) buffer Node { uint word; Node next; };
    struct Value { Node node; uint number; };
    #define GET value.number
    #define SET(n) value.number = n";

const TYPES: [Types; 6] = [
    Types { name: "the same", caller: UINT, called: UINT },
    Types {
        name: "signed and unsigned",
        caller: UINT,
        called: "#define Value int\n#define GET uint(value)\n#define SET(n) value = int(n)",
    },
    Types {
        name: "floats and their bits",
        caller: "#define Value vec2\n#define GET floatBitsToUint(value.y)\n#define SET(n) value.y = uintBitsToFloat(n)",
        called: "#define Value uvec2\n#define GET value.y\n#define SET(n) value.y = n",
    },
    Types {
        name: "arrays in structs",
        caller: "struct Value { vec3 color; uint many[3]; };\n#define GET value.many[2]\n#define SET(n) value.many[2] = n",
        called: "struct Value { ivec3 color; int many[3]; };
                 #define GET uint(value.many[2])\n#define SET(n) value.many[2] = int(n)",
    },
    Types {
        name: "pointers to buffers of other qualifiers",
        caller: "layout(buffer_reference, scalar) buffer Table { uint at[]; };
                 struct Value { Table table; uint number; };\n#define GET value.number\n#define SET(n) value.number = n",
        called: "layout(buffer_reference, scalar) readonly buffer Table { uint at[]; };
                 struct Value { Table table; uint number; };\n#define GET value.number\n#define SET(n) value.number = n",
    },
    Types { name: "pointers to buffers that contain such pointers", caller: NODES, called: NODES },
];

const RAY_GEN: &str = "
    layout(buffer_reference, scalar) buffer Words { uint at[]; };
    layout(push_constant, scalar) uniform Push { Words results; uint tlas; uint hits; uint misses; };
    layout(location = 0) rayPayloadEXT Value value;
    layout(location = 1) callableDataEXT Value data;
    uint called() {
        Value value = data;
        return GET;
    }
    void main() {
        uint i = gl_LaunchIDEXT.x;
        SET(7u);
        data = value;
        if (i < hits + misses) {
            vec3 direction = vec3(0, 0, i < hits ? 1 : -1);
            traceRayEXT(kTLAS[tlas], 0, 0xff, 0, 0, 0, vec3(0.25, 0.25, -1), 0.0, direction, 10.0, 0);
            results.at[i] = GET;
        } else {
            executeCallableEXT(0, 1);
            results.at[i] = called();
        }
    }";

#[test]
fn values_of_the_same_bits_are_passed_on() -> Result<()> {
    for (path, ctx) in pipeline_devices() {
        let scene = GroupScene::new(&ctx)?;
        for Types { name, caller, called } in TYPES {
            let answer = |stage, variable: &str, number: u32| {
                let text = format!(
                    "{called}\nlayout(location = 0) {variable} Value value; void main() {{ SET(GET * 10u + {number}u); }}"
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
