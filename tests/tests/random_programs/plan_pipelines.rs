//! Ray tracing pipelines that come and go while programs run, and traces by them.

use lvk::{
    Context, Dependencies, HitGroup, Holder, Queue, RayTracingPipelineDesc, RayTracingPipelineHandle,
    ShaderModuleDesc, ShaderModuleHandle, ShaderRecord, ShaderSource, ShaderStage, SpecializationConstant,
    SpecializationValue,
};

use super::kit::{HEAD, Push};
use super::memory::{Effect, RAYS, Shading};
use super::plan::{Planned, compute_problems};
use super::world::{Object, Problem, World, judge};

/// Most live pipelines.
const MOST: usize = 3;
/// Most miss shaders, and most hit groups.
const MOST_RECORDS: u16 = 3;
/// Sizes of launches of [`RAYS`] rays, a row and blocks.
const SIZES: [[u32; 3]; 4] = [[12, 1, 1], [4, 3, 1], [2, 3, 2], [1, 1, 12]];

/// The number is that of the miss shader and of the hit group.
const RAY_GEN: &str = "
    layout(location = 0) rayPayloadEXT uint found;
    layout(shaderRecordEXT, scalar) buffer Record { uint direction; };
    void main() {
        uvec3 id = gl_LaunchIDEXT;
        uint i = id.x + gl_LaunchSizeEXT.x * (id.y + gl_LaunchSizeEXT.y * id.z);
        found = 0u;
        vec3 along = vec3(0, 0, float(direction));
        traceRayEXT(kTLAS[index], 0, 0xff, number, 0, number, rayOrigin(i), 0.0, along, 1000.0, 0);
        to.at[i] = found;
    }";

const MISS: &str = "
    layout(location = 0) rayPayloadInEXT uint found;
    layout(constant_id = 0) const uint kSalt = 0;
    layout(shaderRecordEXT, scalar) buffer Record { uint value; };
    void main() { found = 0x01010101u * (value + kSalt); }";

const CLOSEST_HIT: &str = "
    #include <lvk/ray_tracing.glsl>
    layout(location = 0) rayPayloadInEXT uint found;
    layout(shaderRecordEXT, scalar) buffer Record { uint pad[3]; uint value; };
    void main() {
        found = hitWord(gl_InstanceCustomIndexEXT, lvkPrimitiveIndex(index), gl_HitTEXT) + (value << 24);
    }";

/// Shaders of the pipelines.
pub struct RayModules {
    ray_gen: Holder<ShaderModuleHandle>,
    miss: Holder<ShaderModuleHandle>,
    closest_hit: Holder<ShaderModuleHandle>,
}

impl RayModules {
    /// Number of the modules.
    pub const COUNT: usize = 3;

    /// Compiles the shaders.
    pub fn new(ctx: &Context) -> lvk::Result<Self> {
        let module = |stage, text: &str| {
            let text = format!("{HEAD}{text}");
            let source = ShaderSource::Glsl(&text);
            ctx.create_shader_module(&ShaderModuleDesc { stage, source, ..Default::default() })
        };
        Ok(Self {
            ray_gen: module(ShaderStage::RayGen, RAY_GEN)?,
            miss: module(ShaderStage::Miss, MISS)?,
            closest_hit: module(ShaderStage::ClosestHit, CLOSEST_HIT)?,
        })
    }
}

/// Properties of a pipeline in the model.
#[derive(Debug, Clone, Copy)]
pub struct RaysInfo {
    /// Number of ray generation shaders.
    ray_gens: u16,
    /// Number of miss shaders, and of hit groups.
    records: u16,
    /// Value of the first record; each other has one more.
    first: u32,
    /// Specialization constant of the miss shader.
    salt: u32,
}

impl RaysInfo {
    fn new(n: [u16; 6]) -> Self {
        let (first, salt) = (u32::from(n[3] % 24), u32::from(n[4] % 8));
        Self { ray_gens: 1 + n[1] % 2, records: 1 + n[2] % MOST_RECORDS, first, salt }
    }

    /// Returns what rays write that use record `at` of each region.
    fn shading(&self, at: u16) -> Shading {
        let value = self.first + u32::from(at);
        Shading { miss: 0x0101_0101 * (0x21 + value + self.salt), hit: value << 24 }
    }

    /// Creates the pipeline. `mistake` is the kind of a mistake, 0 to 4.
    fn create(
        &self,
        ctx: &Context,
        modules: &RayModules,
        mistake: Option<u16>,
    ) -> lvk::Result<Holder<RayTracingPipelineHandle>> {
        let directions = [[1_u32]; 2];
        let values = 0..u32::from(self.records);
        let misses: Vec<[u32; 1]> = values.clone().map(|at| [0x21 + self.first + at]).collect();
        let hits: Vec<[u32; 4]> = values.map(|at| [0, 0, 0, self.first + at]).collect();
        let mut miss_records: Vec<_> = misses.iter().map(bytes).collect();
        let mut groups: Vec<HitGroup<'_>> = hits
            .iter()
            .map(|record| HitGroup {
                closest_hit: Some(*modules.closest_hit),
                record: bytes(record),
                ..Default::default()
            })
            .collect();
        let mut ray_gen = vec![*modules.ray_gen; usize::from(self.ray_gens)];
        let ray_gen_records: Vec<_> = directions.iter().take(ray_gen.len()).map(bytes).collect();
        let mut max_recursion = 1;
        match mistake {
            Some(0) => max_recursion = 0,
            Some(1) => ray_gen[0] = *modules.miss,
            Some(2) => groups[0].record = ShaderRecord::from_bytes(&[1; 8]),
            Some(3) => miss_records.push(ShaderRecord::default()),
            Some(_) => groups[0].closest_hit = Some(*modules.ray_gen),
            None => {}
        }
        ctx.create_ray_tracing_pipeline(&RayTracingPipelineDesc {
            ray_gen: &ray_gen,
            ray_gen_records: &ray_gen_records,
            miss: &vec![*modules.miss; usize::from(self.records)],
            miss_records: &miss_records,
            hit_groups: &groups,
            max_recursion,
            specialization: &[SpecializationConstant { id: 0, value: SpecializationValue::U32(self.salt) }],
            debug_name: "random pipeline",
            ..Default::default()
        })
    }
}

fn bytes<const N: usize>(record: &[u32; N]) -> ShaderRecord<'_> {
    ShaderRecord::from_bytes(bytemuck::cast_slice(record))
}

impl World<'_> {
    /// Creates a pipeline in one of 16 cases, as drivers take longer for it than for a whole program without any.
    pub(super) fn create_rays(&mut self, n: [u16; 6]) -> Result<bool, String> {
        let alive = self.rays.iter().filter(|rays| rays.holder.is_some()).count();
        let Some(modules) = self.env.kit.ray_modules().filter(|_| n[0].is_multiple_of(16) && alive < MOST)
        else {
            return Ok(false);
        };
        let info = RaysInfo::new(n);
        let mistake = n[5].is_multiple_of(8).then_some(n[5] / 8 % 5);
        let problem = |mistake| if mistake == 2 { Problem::Record } else { Problem::Usage };
        let problems: Vec<_> = mistake.map(problem).into_iter().collect();
        if let Some(holder) = judge(info.create(self.ctx(), modules, mistake), &problems)? {
            self.rays.push(Object::new(holder, info));
        }
        Ok(true)
    }

    /// Plans a trace by a pipeline that the program has created, direct or indirect.
    pub(super) fn trace_rays(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        let rays = self.pick_rays(n[0])?;
        let tlas = self.pick_tlas(n[1])?.live?;
        let to = self.exact_words(n[2], n[3], RAYS)?;
        let mut problems = compute_problems(queue, [rays.problem, to.problem]);
        let info = rays.live.map(|number| self.rays[number].info);
        let (ray_gens, records) = info.map_or((1, 1), |info| (info.ray_gens, info.records));
        let ray_gen = if n[4] % 16 == 15 { ray_gens } else { n[4] % ray_gens };
        let at = n[5] % records;
        if ray_gen >= ray_gens {
            problems.push(Problem::Usage);
        }
        let is_indirect = n[4] & 16 != 0 && self.ctx().capabilities().trace_rays_indirect;
        let offset = match (n[4] >> 5) % 16 {
            0 => 2,
            1 => 8,
            place => 4 * u64::from(place % 2),
        };
        if is_indirect && !matches!(offset, 0 | 4) {
            problems.push(Problem::Usage);
        }
        let effects = match (to.number, info) {
            (Some(number), Some(info)) if problems.is_empty() => {
                vec![Effect::Trace { tlas, to: (number, to.offset), shading: info.shading(at) }]
            }
            _ => Vec::new(),
        };
        let (size, handle) = (SIZES[usize::from(n[5] / 4) % SIZES.len()], rays.handle);
        let (index, own) = (self.tlas[tlas].index, *self.arguments);
        Some(Planned::new(problems, effects, move |env, cmd| {
            let address = env.ctx().buffer_address(to.handle)? + to.offset as u64;
            let writes = Dependencies { buffers: &[to.handle], ..Default::default() };
            if is_indirect {
                cmd.update_buffer(own, offset & 4, bytemuck::cast_slice(&size))?;
            }
            cmd.bind_ray_tracing_pipeline(handle)?;
            cmd.push_constants(&Push { to: address, index, number: u32::from(at), ..Default::default() })?;
            if is_indirect {
                cmd.trace_rays_indirect(u32::from(ray_gen), own, offset, &writes)
            } else {
                cmd.trace_rays_with(u32::from(ray_gen), size, &writes)
            }
        }))
    }
}
