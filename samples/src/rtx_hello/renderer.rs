//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::{Pod, Zeroable};
use lvk::{
    AccelStructHandle, BlasDesc, BlasGeometry, BufferHandle, BufferUsage, BuildFlags, Context, Holder,
    TextureHandle, TlasDesc, TlasInstance, Triangles, transform_rows,
};

use super::instances::{CORNERS, groups, places};
use super::panel::RtxHelloSettings;
use super::pipelines::RAYS;
use crate::app::array_buffer::array;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::rtx::{RtxConfig, Tracer};
use crate::scene::{Camera, GpuCamera};

/// Half the height of what is seen at distance 1.
const HALF_HEIGHT: f32 = 0.55;

/// Renders the triangles.
pub struct RtxHello {
    ctx: Context,
    target: RenderTarget,
    config: RtxConfig,
    tracer: Tracer,
    tlas: Holder<AccelStructHandle>,
    blas: Holder<AccelStructHandle>,
    settings: RtxHelloSettings,
    phase: f32,
    camera: Camera,
    _vertices: Holder<BufferHandle>,
}

lvk::shader_struct! {
    /// `Push` in `shaders/rtx_hello/view.glsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct Push {
        camera: GpuCamera,
        tlas: u32,
        image: u32,
    }
}

impl RtxHello {
    /// Makes the triangle, its structures and the pipeline. The animation stands at its beginning.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(ctx: &Context, config: &RtxConfig) -> Result<Self, SampleError> {
        let target = config.create_target(ctx)?;
        let vertices = array(ctx, "triangle", BufferUsage::ACCEL_INPUT, &CORNERS)?;
        let blas = ctx.create_blas(&BlasDesc {
            geometries: &[BlasGeometry::Triangles(Triangles::packed(*vertices, 3))],
            ..BlasDesc::default()
        })?;
        let settings = RtxHelloSettings::default();
        let tlas = ctx.create_tlas(&TlasDesc {
            instances: &instances(*blas, 0.0, &settings),
            flags: BuildFlags::ALLOW_UPDATE,
            ..TlasDesc::default()
        })?;
        let tracer = Tracer::new(ctx, config.path, &RAYS)?;
        Ok(Self {
            ctx: ctx.clone(),
            target,
            config: *config,
            tracer,
            tlas,
            blas,
            settings,
            phase: 0.0,
            camera: camera(),
            _vertices: vertices,
        })
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        groups().count()
    }

    /// Settings of the panel, which take effect with the next frame.
    pub fn settings(&mut self) -> &mut RtxHelloSettings {
        &mut self.settings
    }
}

impl Sample for RtxHello {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.phase = time.phase();
        self.camera = camera();
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let [width, height] = self.config.extent();
        let camera = GpuCamera::new(&self.camera, width, height, 0.0);
        let push = Push { camera, tlas: self.tlas.index(), image: self.target.image_index() };
        let instances = instances(*self.blas, self.phase, &self.settings);
        frame.pass("TLAS update", |cmd| cmd.update_tlas(*self.tlas, &instances, self.settings.mode()))?;
        Ok(self.tracer.record_image(frame, &self.target, &push)?)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = self.config.resize(&self.ctx, extent)?;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        self.settings.show(ui);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.tracer = Tracer::new(&self.ctx, self.config.path, &RAYS)?;
        Ok(())
    }
}

/// The camera until the user moves it.
fn camera() -> Camera {
    Camera::looking_at([0.0, 0.0, 3.2], [0.0; 3], 2.0 * HALF_HEIGHT.atan().to_degrees())
}

fn instances(blas: AccelStructHandle, phase: f32, settings: &RtxHelloSettings) -> Vec<TlasInstance> {
    let instance = |(place, group)| TlasInstance {
        transform: transform_rows(&place),
        mask: settings.mask(group),
        ..TlasInstance::new(blas)
    };
    places(phase).into_iter().zip(groups()).map(instance).collect()
}
