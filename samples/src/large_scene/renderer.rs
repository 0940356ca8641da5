//! Renders the sample at a frame time.

use crate::app::render_target::RenderTarget;
use crate::app::run_error::RunError;
use crate::app::sample_error::SampleError;
use bytemuck::{Pod, Zeroable};
use lvk::{CommandBuffer, Context, TextureHandle};

use super::LargeSceneConfig;
use super::figures::Figures;
use super::gpu_world::GpuWorld;
use super::pipelines::RAYS;
use super::world::World;
use crate::app::frame::Frame;
use crate::app::progress::Progress;
use crate::app::sample::{FrameTime, Sample};
use crate::hybrid::{Lighting, SceneFrame};
use crate::rtx::Tracer;
use crate::scene::{Ambient, Camera, CameraTour, DirectionalLight, GpuCamera, Scene};

/// Distance of the near plane as a share of the world's farthest coordinate; rays start at the eye.
const NEAR_SHARE: f32 = 1e-4;

/// Renders a world of millions of triangles.
pub struct LargeScene {
    ctx: Context,
    target: RenderTarget,
    config: LargeSceneConfig,
    world: GpuWorld,
    tracer: Tracer,
    constants: FrameConstants,
    tour: CameraTour,
    near_plane: f32,
}

lvk::shader_struct! {
    /// `Frame` in `shaders/large_scene/frame.glsl`.
    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub(super) struct FrameConstants {
        scene as scene_frame: SceneFrame,
        places: u64,
        firsts: u64,
        image: u32,
        depth: u32,
        samples: u32,
        show: u32,
    }
}

impl LargeScene {
    /// Uploads `world`, loads or builds its acceleration structures and makes the pipeline; `progress` shows how far that is.
    ///
    /// # Errors
    /// [`SampleError`] when the configuration or the world is beyond the device, or the device fails. Trouble with files of
    /// the cache is none, but a warning.
    pub fn new(
        ctx: &Context,
        world: &World,
        config: &LargeSceneConfig,
        progress: &mut Progress,
    ) -> Result<Self, SampleError> {
        let config = config.clone().clamped();
        let target = config.rtx.create_target(ctx)?;
        let gpu_world = GpuWorld::new(ctx, world, &config, progress)?;
        progress.stage("compiling shaders", 0);
        let [places, firsts] = gpu_world.tables()?;
        let farthest = world.farthest();
        let constants = FrameConstants {
            scene: SceneFrame {
                camera: GpuCamera::zeroed(),
                scene: gpu_world.scene(),
                lighting: lighting(world.scene(), farthest),
                tlas: gpu_world.structures.tlas.index(),
                sky: gpu_world.sky.index(),
                surface_sampler: gpu_world.surface_sampler.index(),
                sky_sampler: gpu_world.sky_sampler.index(),
            },
            places,
            firsts,
            ..FrameConstants::zeroed()
        };
        Ok(Self {
            tracer: Tracer::new(ctx, config.rtx.path, &RAYS)?,
            tour: CameraTour::new(world.scene(), 0),
            near_plane: (NEAR_SHARE * farthest).max(f32::MIN_POSITIVE),
            ctx: ctx.clone(),
            world: gpu_world,
            target,
            config,
            constants,
        })
    }

    /// Tours the world's cameras from the one with this index on.
    #[must_use]
    pub fn from_camera(mut self, world: &World, first: usize) -> Self {
        self.tour = CameraTour::new(world.scene(), first);
        self
    }

    /// The configuration.
    pub fn config(&self) -> &LargeSceneConfig {
        &self.config
    }

    /// Memory of the world on the device, and the origin of its acceleration structures.
    pub fn figures(&self) -> &Figures {
        &self.world.figures
    }

    fn upload_frame(&self, cmd: &mut CommandBuffer) -> lvk::Result<u64> {
        let [width, height] = self.config.rtx.extent();
        let camera = GpuCamera::new(&self.tour.camera, width, height, self.near_plane);
        cmd.upload(&FrameConstants {
            scene: SceneFrame { camera, ..self.constants.scene },
            image: self.target.image_index(),
            depth: self.config.depth,
            samples: self.config.samples,
            show: self.config.show.number(),
            ..self.constants
        })
    }
}

impl Sample for LargeScene {
    fn context(&self) -> &Context {
        &self.ctx
    }

    fn update(&mut self, time: FrameTime) {
        self.tour.go_to(time.phase());
    }

    fn record(&mut self, frame: &mut Frame<'_>) -> Result<TextureHandle, RunError> {
        let push = self.upload_frame(&mut frame.cmd)?;
        Ok(self.tracer.record_image(frame, &self.target, &push)?)
    }

    fn resize(&mut self, extent: [u32; 2]) -> Result<(), RunError> {
        self.target = self.config.rtx.resize(&self.ctx, extent)?;
        Ok(())
    }

    fn camera_mut(&mut self) -> Option<&mut Camera> {
        Some(&mut self.tour.camera)
    }

    #[cfg(feature = "window")]
    fn panel(&mut self, ui: &mut egui::Ui) {
        let LargeSceneConfig { depth, samples, show, .. } = &mut self.config;
        ui.horizontal(|ui| {
            for which in super::Show::ALL {
                ui.selectable_value(show, which, format!("{which:?}").to_lowercase());
            }
        });
        ui.add(egui::Slider::new(depth, 0..=LargeSceneConfig::MAX_DEPTH).text("mirrored or bent"));
        ui.add(egui::Slider::new(samples, 1..=16).text("samples a pixel"));
        show_figures(ui, &self.world.figures);
    }

    fn reload(&mut self) -> Result<(), RunError> {
        self.tracer = Tracer::new(&self.ctx, self.config.rtx.path, &RAYS)?;
        Ok(())
    }
}

#[cfg(feature = "window")]
fn show_figures(ui: &mut egui::Ui, figures: &Figures) {
    use super::figures::{Origin, bytes, number};

    egui::CollapsingHeader::new("Memory").default_open(true).show(ui, |ui| {
        for (name, value) in figures.entries() {
            ui.label(format!("{name} {value}"));
        }
    });
    egui::CollapsingHeader::new("Structures").show(ui, |ui| {
        egui::Grid::new("structures").striped(true).num_columns(5).show(ui, |ui| {
            for structure in &figures.structures {
                let origin = match structure.origin {
                    Origin::Loaded => "from a file",
                    Origin::Built => "built",
                    Origin::Rebuilt => "built anew",
                };
                ui.label(&structure.name);
                ui.monospace(number(structure.triangles));
                ui.label(format!("{} parts", structure.parts));
                ui.monospace(format!("{} of {}", bytes(structure.bytes), bytes(structure.built_bytes)));
                ui.label(origin);
                ui.end_row();
            }
        });
    });
}

fn lighting(scene: &Scene, farthest: f32) -> Lighting {
    let Ambient { above, below } = scene.ambient;
    let no_sun = DirectionalLight { direction: [0.0, 1.0, 0.0], color: [0.0; 3] };
    Lighting::sunlit(&scene.sun.unwrap_or(no_sun), &Ambient { above, below }, farthest)
}

const _: () = assert!(std::mem::offset_of!(FrameConstants, places) == 264);
