//! Plans of passes that draw by mesh shaders.

use lvk::{Context, IndirectCount, OptionalFeature, Queue, RenderPass, RenderPipelineHandle};
use lvk_tests::random::Random;

use super::draw_items::{ARGUMENTS, DrawBuffers, Inputs, MOST_DRAWS, Triangles, mesh_items};
use super::kit::Push;
use super::kit_draws::FrontEnd;
use super::plan::Planned;
use super::world::{Problem, World};

/// Way in which the numbers of workgroups come to a draw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Direct,
    Indirect,
    /// The buffer has the number of draws too.
    Counted,
}

/// Mistakes of mesh draws. Each is found after the pass has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mistake {
    OtherPipeline,
    OddArguments,
    Unlisted,
    /// More workgroups than any device allows.
    TooMany,
}

/// Draws of a mesh pipeline, with or without a task shader.
struct MeshDraws {
    is_task: bool,
    form: Form,
    /// Workgroups of each draw.
    groups: Vec<[u32; 3]>,
    /// Number of draws in the buffer, if the draws read it.
    number: Option<u32>,
    stride: u32,
    mistake: Option<Mistake>,
}

impl MeshDraws {
    fn new(n: [u16; 6], ctx: &Context, random: &mut Random) -> Self {
        let mut below = |most: u32| (random.bits() % u64::from(most)) as u32;
        let is_task = n[3] & 2 == 2;
        let form = [Form::Direct, Form::Indirect, Form::Counted][usize::from(n[3] / 4 % 3)];
        let draws = if form == Form::Direct { 1 } else { below(MOST_DRAWS + 1) };
        let most = if is_task { 3 } else { 5 };
        let groups = (0..draws).map(|_| [below(most), 1 + below(2), 1]).collect();
        let limits = &ctx.capabilities().limits.mesh;
        let most = limits.max_mesh_workgroups[0].max(limits.max_task_workgroups[0]);
        let mistake = match (n[5] % 12, n[5] / 12 % 3, form) {
            (0, 0, _) => Some(Mistake::OtherPipeline),
            (0, 1, Form::Indirect | Form::Counted) => Some(Mistake::OddArguments),
            (0, 2, Form::Indirect | Form::Counted) => Some(Mistake::Unlisted),
            (1, 0, Form::Direct) if most < u32::MAX => Some(Mistake::TooMany),
            _ => None,
        };
        let number = (form == Form::Counted).then(|| below(MOST_DRAWS + 2));
        Self { is_task, form, groups, number, stride: 12 + 4 * below(3), mistake }
    }

    /// Returns the problems of the draws.
    fn problems(&self, ctx: &Context) -> Vec<Problem> {
        let is_lacking =
            self.form == Form::Counted && !ctx.capabilities().has(OptionalFeature::DrawIndirectCount);
        let wrong = self.mistake.map(|mistake| match mistake {
            Mistake::TooMany => Problem::Limit,
            _ => Problem::Usage,
        });
        wrong.into_iter().chain(is_lacking.then_some(Problem::Unsupported)).collect()
    }

    /// Returns the items that are painted.
    fn items(&self) -> Vec<u32> {
        let executed = self.number.map_or(self.groups.len(), |number| number as usize);
        self.groups.iter().take(executed).flat_map(|groups| mesh_items(*groups, self.is_task)).collect()
    }

    fn front_end(&self) -> FrontEnd {
        match (self.mistake, self.is_task) {
            (Some(Mistake::OtherPipeline), _) => FrontEnd::Vertices,
            (_, true) => FrontEnd::Task,
            (_, false) => FrontEnd::Mesh,
        }
    }

    /// Returns what the draws read. Mesh shaders read no triangles.
    fn inputs(&self, n: u16, random: &mut Random) -> Inputs {
        let arguments: Vec<Vec<u32>> = self.groups.iter().map(|groups| groups.to_vec()).collect();
        let is_unlisted = self.mistake == Some(Mistake::Unlisted);
        Inputs::new(n, &Triangles::random(random), (&arguments, self.stride), self.number, is_unlisted)
    }

    fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        buffers: DrawBuffers,
        pipeline: RenderPipelineHandle,
        seed: u16,
    ) -> lvk::Result<()> {
        pass.bind_render_pipeline(pipeline)?;
        pass.push_constants(&Push { number: seed.into(), ..Default::default() })?;
        let offset = ARGUMENTS + if self.mistake == Some(Mistake::OddArguments) { 2 } else { 0 };
        let (draws, stride) = (self.groups.len() as u32, self.stride);
        match self.form {
            Form::Direct if self.mistake == Some(Mistake::TooMany) => pass.draw_mesh_tasks([u32::MAX, 1, 1]),
            Form::Direct => pass.draw_mesh_tasks(self.groups[0]),
            Form::Indirect => pass.draw_mesh_tasks_indirect(buffers.inputs, offset, draws, stride),
            Form::Counted => pass.draw_mesh_tasks_indirect_count(&IndirectCount {
                arguments: buffers.inputs,
                offset,
                stride,
                count: buffers.number,
                count_offset: 0,
                max_draws: draws,
            }),
        }
    }
}

impl World<'_> {
    /// Plans a pass that draws by mesh shaders, by task shaders too or not: directly, indirectly, and with a number of
    /// draws from a buffer. The draws paint other items for other numbers of workgroups.
    pub(super) fn draw_mesh(&self, n: [u16; 6], queue: Queue) -> Option<Planned> {
        if !self.ctx().capabilities().mesh_shader {
            return None;
        }
        let random = &mut Random::new(n[3].into());
        let draws = MeshDraws::new(n, self.ctx(), random);
        let pass = self.draw_pass(n, queue, draws.problems(self.ctx()))?;
        let pipeline = self.env.kit.draw_kit.items(draws.front_end(), pass.format)?;
        let (seed, items, inputs) = (n[4] % 1000, draws.items(), draws.inputs(n[5], random));
        let draw = move |_: &_, pass: &mut RenderPass<'_>, buffers| draws.draw(pass, buffers, pipeline, seed);
        Some(self.painted(pass, seed, &items, inputs, draw))
    }
}
