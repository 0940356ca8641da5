//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use lvk::{
    BufferHandle, BufferUsage, CommandBuffer, Context, CullMode, Dependencies, Holder, RenderPipelineDesc,
    RenderPipelineHandle, TextureHandle,
};

use super::counter::Counter;
use super::knot::knot;
use super::meshlets::Meshlets;
use super::pipelines::MESHLETS;
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::scene::{Camera, GpuCamera};
use crate::shapes::GpuVertex;

/// Meshlets that a task workgroup looks at (`kMeshletsPerTask` in `shaders/mesh_shaders/payload.glsl`).
const MESHLETS_PER_TASK: u32 = 32;
const BACKDROP: [f32; 3] = [0.010, 0.012, 0.020];
const NEAR_PLANE: f32 = 0.05;

/// Draws the knot.
pub struct MeshShaders {
    ctx: Context,
    target: RenderTarget,
    pipeline: Holder<RenderPipelineHandle>,
    vertices: Vec<GpuVertex>,
    meshlets: Meshlets,
    counter: Counter,
    constants: FrameConstants,
    camera: Camera,
    /// The camera for culling, if it is not the camera of the image.
    held: Option<Camera>,
    _buffers: [Holder<BufferHandle>; 4],
}

/// `Frame` in `shaders/mesh_shaders/frame.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrameConstants {
    camera: GpuCamera,
    culling_camera: GpuCamera,
    meshlets: u64,
    vertices: u64,
    vertex_numbers: u64,
    triangles: u64,
    counter: u64,
    count: u32,
    culls: u32,
    phase: f32,
    apart: f32,
}

impl MeshShaders {
    /// Cuts the knot and makes the pipeline, for pictures of `extent` pixels. Meshlets that cannot be seen are left out if it
    /// `culls`. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError::Missing`] on devices without mesh shaders, and otherwise when the picture is beyond the device, or the
    /// device fails.
    pub fn new(ctx: &Context, extent: [u32; 2], culls: bool) -> Result<Self, SampleError> {
        let remedy = "take another device by --device; --list-devices says which there are";
        SampleError::require(ctx.capabilities().mesh_shader, ctx, "mesh shaders", remedy)?;
        let target = RenderTarget::with_depth(ctx, extent)?;
        let (vertices, meshlets) = model();
        let counter = Counter::new(ctx)?;
        let usage = BufferUsage::STORAGE;
        let buffers = [
            array(ctx, "meshlets", usage, &meshlets.meshlets)?,
            array(ctx, "vertices", usage, &vertices)?,
            array(ctx, "vertex numbers", usage, &meshlets.vertices)?,
            array(ctx, "triangles", usage, &meshlets.triangles)?,
        ];
        let constants = FrameConstants {
            camera: GpuCamera::zeroed(),
            culling_camera: GpuCamera::zeroed(),
            meshlets: buffers[0].address()?,
            vertices: buffers[1].address()?,
            vertex_numbers: buffers[2].address()?,
            triangles: buffers[3].address()?,
            counter: counter.buffer.address()?,
            count: meshlets.meshlets.len() as u32,
            culls: culls.into(),
            phase: 0.0,
            apart: 0.16,
        };
        Ok(Self {
            ctx: ctx.clone(),
            target,
            pipeline: pipeline(ctx)?,
            vertices,
            meshlets,
            counter,
            constants,
            camera: camera(0.0),
            held: None,
            _buffers: buffers,
        })
    }

    /// The knot in pieces, whose vertices are [`vertices`](Self::vertices).
    #[must_use]
    pub fn meshlets(&self) -> &Meshlets {
        &self.meshlets
    }

    /// Corners of the knot, at rest.
    #[must_use]
    pub fn vertices(&self) -> &[GpuVertex] {
        &self.vertices
    }

    /// Returns the number of meshlets drawn by the latest frame whose count has arrived.
    #[must_use]
    pub fn drawn(&self) -> Option<u32> {
        self.counter.latest()
    }

    /// Uploads the constants that all stages read (`Frame` in `shaders/mesh_shaders/frame.glsl`), and returns their address.
    ///
    /// # Errors
    /// Those of [`CommandBuffer::upload`].
    pub fn upload(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let [width, height] = self.target.extent();
        let seen_by = |camera: &Camera| GpuCamera::new(camera, width, height, NEAR_PLANE);
        let culling_camera = seen_by(self.held.as_ref().unwrap_or(&self.camera));
        cmd.upload(&FrameConstants { camera: seen_by(&self.camera), culling_camera, ..self.constants })
    }

    fn culling_text(&self) -> String {
        let count = self.meshlets.meshlets.len();
        match self.drawn() {
            Some(drawn) => format!("{drawn} of {count} meshlets drawn"),
            None => format!("{count} meshlets"),
        }
    }
}

impl Sample for MeshShaders {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.constants.phase = time.phase();
        self.camera = camera(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let constants = self.upload(&mut frame.cmd)?;
        self.counter.begin(&self.ctx, &mut frame.cmd)?;
        let counts = Dependencies { buffers: &[*self.counter.buffer], ..Dependencies::default() };
        let mut pass = self.target.begin(&mut frame.cmd, "meshlets", BACKDROP, &counts)?;
        pass.bind_render_pipeline(*self.pipeline)?;
        pass.push_constants(&constants)?;
        pass.draw_mesh_tasks([self.constants.count.div_ceil(MESHLETS_PER_TASK), 1, 1])?;
        Ok(self.target.image())
    }

    fn after_frame(&mut self) -> Result<(), RunError> {
        Ok(self.counter.read(&self.ctx)?)
    }

    fn remark(&self) -> Result<Option<String>, RunError> {
        Ok(Some(format!("culling   {}", self.culling_text())))
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = RenderTarget::with_depth(&self.ctx, extent)?;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        ui.label(self.culling_text());
        let (mut culls, mut is_held) = (self.constants.culls == 1, self.held.is_some());
        ui.checkbox(&mut culls, "leave out what cannot be seen");
        if ui.checkbox(&mut is_held, "from here, wherever the camera goes").changed() {
            self.held = is_held.then_some(self.camera);
        }
        self.constants.culls = culls.into();
        ui.add(egui::Slider::new(&mut self.constants.apart, 0.0..=0.6).text("apart"));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.pipeline = pipeline(&self.ctx)?;
        Ok(())
    }
}

/// The knot's vertices, and its pieces.
fn model() -> (Vec<GpuVertex>, Meshlets) {
    let knot = knot();
    let vertices = knot.vertices.iter().map(GpuVertex::from);
    let positions: Vec<Vec3> = knot.vertices.iter().map(|vertex| vertex.position).collect();
    let triangles: Vec<_> = knot.triangles.iter().map(|vertices| vertices.map(u32::from)).collect();
    (vertices.collect(), Meshlets::build(&positions, &triangles))
}

fn pipeline(ctx: &Context) -> lvk::Result<Holder<RenderPipelineHandle>> {
    MESHLETS.create_with(ctx, &RenderPipelineDesc { cull: CullMode::Back, ..RenderPipelineDesc::default() })
}

/// The camera of the animation at `phase` of the round, 0 to 1.
fn camera(phase: f32) -> Camera {
    let eye = [0.0, 3.4 + 0.6 * (TAU * phase).sin(), 4.3];
    Camera::looking_at(eye, [0.0, -0.22, 0.0], 43.0)
}
