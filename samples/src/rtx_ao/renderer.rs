//! The sample as a type: a renderer of a scene and a view, whose picture improves with each call.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use glam::{Affine3A, Vec3};
use lvk::{
    AccelStructHandle, BuildMode, CommandBuffer, Context, Holder, SamplerDesc, SamplerHandle, TextureHandle,
    TlasDesc, TlasInstance, transform_rows,
};

use super::body::Body;
use super::config::RtxAoConfig;
use super::frame::{FrameConstants, Lighting};
use super::light_pass::{Cache, LightRays};
use super::raster::{Drawn, Raster};
use super::targets::Targets;
use crate::app::frame::Frame;
use crate::app::sample::{FrameTime, Sample};
use crate::hybrid::RayPath;
use crate::scene::{Camera, CameraPath, GpuCamera, Scene};

/// Default radius of the ambient occlusion, as a share of the diagonal of the scene's bounding box.
const RADIUS_SHARE: f32 = 0.06;
/// Distance of the near plane as a share of the distance of what the camera looks at.
const NEAR_SHARE: f32 = 0.01;
/// Offset of rays from a surface, as a share of the radius.
const LIFT_SHARE: f32 = 1e-3;

/// The camera, and the angle of the turning part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Turns of the second body about the vertical.
    pub turns: f32,
}

/// Renders a scene of one body, or of one that stands and one that turns.
pub struct RtxAo {
    ctx: Context,
    target: RenderTarget,
    config: RtxAoConfig,
    bodies: Vec<Body>,
    tlas: Holder<AccelStructHandle>,
    targets: Targets,
    raster: Raster,
    rays: Option<LightRays>,
    cache: Cache,
    path: CameraPath,
    lighting: Lighting,
    sampler: Holder<SamplerHandle>,
    view: View,
    passes: u32,
}

impl RtxAo {
    /// Uploads `scene`, and what turns in it if anything does, and makes all pipelines. Refractive triangles are left out.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration is beyond the device, or the device fails.
    pub fn new(
        ctx: &Context,
        scene: &Scene,
        turning: Option<&Scene>,
        config: &RtxAoConfig,
    ) -> Result<Self, SampleError> {
        let (config, extent) = (config.clamped(), config.rtx.extent());
        let target = config.rtx.create_target(ctx)?;
        let bodies: Vec<_> = [Some(scene), turning]
            .into_iter()
            .flatten()
            .map(|scene| Body::new(ctx, scene))
            .collect::<Result<_, _>>()?;
        let tlas = ctx.create_tlas(&TlasDesc { capacity: bodies.len() as u32, ..TlasDesc::default() })?;
        let path = CameraPath::tour(scene, 0);
        let radius = config.radius.unwrap_or_else(|| usual_radius(scene));
        Ok(Self {
            targets: Targets::new(ctx, config.rtx.path, extent)?,
            raster: Raster::new(ctx, config.rtx.path)?,
            rays: light_rays(ctx, config.rtx.path)?,
            cache: Cache::new(ctx, extent)?,
            lighting: Lighting::new(scene, radius, tlas.index()),
            sampler: ctx.create_sampler(&SamplerDesc { max_anisotropy: 8.0, ..SamplerDesc::default() })?,
            view: View { camera: path.at(0.0), turns: 0.0 },
            path,
            ctx: ctx.clone(),
            target,
            config,
            bodies,
            tlas,
            passes: 0,
        })
    }

    /// Tours the scene's cameras from the one with this index on.
    #[must_use]
    pub fn from_camera(mut self, scene: &Scene, first: usize) -> Self {
        self.path = CameraPath::tour(scene, first);
        self.show(&View { camera: self.path.at(0.0), turns: 0.0 });
        self
    }

    /// Sets the view of the scene. A view other than the last one clears the cache.
    pub fn show(&mut self, view: &View) {
        if self.view != *view {
            self.view = *view;
            self.passes = 0;
        }
    }

    /// The view that is shown.
    pub fn current_view(&self) -> &View {
        &self.view
    }

    /// Number of passes that the image averages.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    /// Radius of the ambient occlusion in scene units.
    pub fn radius(&self) -> f32 {
        self.lighting.radius()
    }

    /// Triangles of all bodies.
    pub fn triangle_count(&self) -> u32 {
        self.bodies.iter().map(|body| body.triangle_count).sum()
    }

    /// The openness of each pixel so far, 0 to 1, rows from the top; 1 where the sky is.
    ///
    /// # Errors
    /// [`SampleError::Device`].
    pub fn openness(&self) -> Result<Vec<f32>, SampleError> {
        let [width, height] = self.config.rtx.extent();
        let mut sums = vec![[0.0_f32; 4]; (width * height) as usize];
        self.ctx.download_buffer(*self.cache.sums, 0, bytemuck::cast_slice_mut(&mut sums))?;
        Ok(sums.iter().map(|sum| sum[3] / self.passes.max(1) as f32).collect())
    }

    fn places(&self) -> [Affine3A; 2] {
        [Affine3A::IDENTITY, Affine3A::from_rotation_y(std::f32::consts::TAU * self.view.turns)]
    }

    fn upload_frame(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let bodies = self.bodies.iter().zip(self.places());
        let bodies: Vec<_> = bodies.map(|(body, place)| body.constants(&place)).collect();
        let [width, height] = self.config.rtx.extent();
        let View { camera, .. } = &self.view;
        let near = NEAR_SHARE * Vec3::from(camera.eye).distance(Vec3::from(camera.target));
        let constants = FrameConstants {
            camera: GpuCamera::new(camera, width, height, near).for_sample(self.passes, u32::MAX),
            bodies: cmd.upload_slice(&bodies)?,
            sums: self.cache.sums.address()?,
            light: self.lighting,
            image: self.target.image_index(),
            sampler: self.sampler.index(),
            targets: self.targets.indices(),
            pass: self.passes,
            rays: self.config.rays,
            lift: LIFT_SHARE * self.radius(),
            padding: 0,
        };
        cmd.upload(&constants)
    }

    fn update_tlas(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        let instances: Vec<_> = self
            .bodies
            .iter()
            .zip(self.places())
            .map(|(body, place)| TlasInstance {
                transform: transform_rows(&place),
                ..TlasInstance::new(*body.blas)
            })
            .collect();
        cmd.update_tlas(*self.tlas, &instances, BuildMode::Rebuild)
    }

    /// One more pass. The structure is built in the first after a change.
    fn add_pass(&mut self, to: &mut Frame<'_>) -> lvk::Result<()> {
        let (frame, extent) = (self.upload_frame(&mut to.cmd)?, self.config.rtx.extent());
        let targets = &self.targets;
        if self.passes == 0 {
            to.pass("TLAS build", |cmd| self.update_tlas(cmd))?;
        }
        let drawn = Drawn { targets, bodies: &self.bodies, frame };
        self.raster.record_depth(&mut to.cmd, &drawn)?;
        self.raster.record_surfaces(&mut to.cmd, &drawn)?;
        if let Some(rays) = &self.rays {
            to.pass("rays", |cmd| rays.record(cmd, targets, extent, frame))?;
        }
        let picture = self.target.image();
        to.pass("cache", |cmd| self.cache.record(cmd, targets, picture, extent, frame))?;
        self.passes += 1;
        Ok(())
    }
}

impl Sample for RtxAo {
    fn context(&self) -> &Context {
        &self.ctx
    }

    /// Begins anew even where nothing moved, so that a frame does not depend on those before.
    fn update(&mut self, time: FrameTime) {
        let phase = time.phase();
        self.show(&View { camera: self.path.at(phase), turns: phase });
        self.passes = 0;
    }

    fn steps_per_frame(&self) -> u64 {
        self.config.passes.into()
    }

    /// Each frame adds to those before as long as nothing moves.
    fn stands_at_first(&self) -> bool {
        true
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        for pass in 0..self.config.passes {
            if pass > 0 {
                frame.next_step()?;
            }
            self.add_pass(frame)?;
        }
        Ok(self.target.image())
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        let targets = Targets::new(&self.ctx, self.config.rtx.path, extent)?;
        let sums = Cache::sums(&self.ctx, extent)?;
        self.target = self.config.rtx.resize(&self.ctx, extent)?;
        (self.targets, self.cache.sums) = (targets, sums);
        self.passes = 0;
        Ok(())
    }

    fn view(&mut self) -> Option<Camera> {
        Some(self.view.camera)
    }

    fn set_view(&mut self, camera: &Camera) {
        self.show(&View { camera: *camera, ..self.view });
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let RtxAoConfig { passes, rays, .. } = &mut self.config;
        ui.add(egui::Slider::new(passes, 1..=64).text("passes a frame"));
        if ui.add(egui::Slider::new(rays, 1..=RtxAoConfig::MAX_RAYS).text("rays a pass")).changed() {
            self.passes = 0;
        }
        ui.label(format!("{} passes in the picture", self.passes));
    }

    fn reload(&mut self) -> Result<(), RunError> {
        let path = self.config.rtx.path;
        let (raster, rays) = (Raster::new(&self.ctx, path)?, light_rays(&self.ctx, path)?);
        self.cache.pipeline = Cache::pipeline(&self.ctx)?;
        (self.raster, self.rays) = (raster, rays);
        self.passes = 0;
        Ok(())
    }
}

/// The pass of rays by pipeline, on the path that has it.
fn light_rays(ctx: &Context, path: RayPath) -> lvk::Result<Option<LightRays>> {
    (path == RayPath::Pipeline).then(|| LightRays::new(ctx)).transpose()
}

fn usual_radius(scene: &Scene) -> f32 {
    let (low, high) = scene.bounds();
    RADIUS_SHARE * Vec3::from(low).distance(Vec3::from(high))
}
