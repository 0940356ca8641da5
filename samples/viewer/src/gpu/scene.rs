//! A model on the GPU: arrays, textures, light and acceleration structures.

use lvk::{AccelStructHandle, BufferHandle, BufferUsage, CommandBuffer, Context, Holder, TlasDesc};
use lvk_gltf::{Bounds, Model, Placement, Pose};
use lvk_samples::app::array_buffer::array;
use lvk_samples::app::frame::Frame;
use lvk_samples::app::run_error::RunError;
use lvk_samples::app::sample_error::SampleError;

use super::albedo_table::albedo_table;
use super::culling::Culling;
use super::emitters::Emitters;
use super::geometry::{GpuMeshes, UploadedMeshes};
use super::ignored;
use super::instances::{Draw, MeshKey, SceneInstances};
use super::layout::{AmbientConstants, EmissionConstants, GpuTextureSlot, LightConstants, SceneConstants};
use super::lights::{GpuLights, LightSetting};
use super::materials::GpuMaterials;
use super::motion::SceneMotion;
use super::textures::{GpuTextures, TextureMemory};
use crate::light::Environment;
use crate::model::rig;

/// A scene's largest coordinate over the extent that rounding errors near the origin are measured by.
const OFFSET_SHARE: f32 = 8.0;

/// A model on the GPU.
pub(crate) struct GpuScene {
    constants: SceneConstants,
    pub(crate) light: LightConstants,
    pub(crate) tlas: Holder<AccelStructHandle>,
    /// The unit of length of rounding errors near the origin.
    pub(crate) offset_extent: f32,
    /// Triangles of all meshes, each mesh once.
    pub(crate) triangle_count: u64,
    /// Bytes of the structures of meshes, and of the top level.
    pub(crate) structure_bytes: [u64; 2],
    /// What is left out, for the user to read.
    pub(crate) warnings: Vec<String>,
    /// The model without what is uploaded.
    rig: Model,
    shown: usize,
    instances: SceneInstances,
    lights: GpuLights,
    emitters: Emitters,
    light_setting: LightSetting,
    /// `None` if the model has no animations.
    motion: Option<SceneMotion>,
    meshes: GpuMeshes,
    culling: Culling,
    textures: GpuTextures,
    /// Texture slots of the materials. Those on the GPU are the same unless mip levels come and go.
    slots: Vec<GpuTextureSlot>,
    _buffers: Vec<Holder<BufferHandle>>,
}

impl GpuScene {
    /// Uploads the scene `shown` of `model` in a pose and builds its structures. Directional lights are discs of the radius
    /// `disc_radius`, in radians. All of it is inside of `bounds`. Vertices of the model are freed as they are uploaded.
    pub(crate) fn new(
        ctx: &Context,
        (mut model, shown): (Model, usize),
        pose: &Pose,
        (environment, disc_radius): (&Environment, f32),
        bounds: &Bounds,
        texture_budget: Option<u64>,
    ) -> Result<Self, SampleError> {
        let textures = GpuTextures::new(ctx, &model, texture_budget)?;
        let placements = model.placements(shown, pose);
        let keys: Vec<MeshKey> = placements.iter().map(|placement| MeshKey::new(&model, placement)).collect();
        let UploadedMeshes { meshes, deformation } =
            GpuMeshes::upload(ctx, &mut model, pose, &unique(&keys))?;
        let instances = SceneInstances::new(&placements, &keys, &meshes);
        let light_setting = LightSetting::new(&model, environment, disc_radius, *bounds);
        let emitters = meshes.emissive.emitters(&instances.table);
        let lights = GpuLights::new((&model, shown), pose, &emitters, &light_setting);
        let culling = Culling::new(ctx, &instances)?;
        let mut arrays = Arrays { ctx, held: Vec::new() };
        let materials = GpuMaterials::new(&model, &textures);
        let warnings = [textures.warnings.clone(), ignored::warnings(&model)].concat();
        let shown_meshes = (&meshes, &instances, &culling);
        let constants = arrays.constants(shown_meshes, &materials, (&lights, &emitters), environment)?;
        let tlas = tlas(ctx, &instances)?;
        let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let motion = SceneMotion::new(deformation, meshes.deformed(), pose.clone());
        let motion = (!model.animations.is_empty()).then_some(motion);
        Ok(Self {
            constants,
            light: light_constants(&lights, environment),
            offset_extent: (largest / OFFSET_SHARE).max(f32::MIN_POSITIVE),
            triangle_count: meshes.triangle_counts.iter().map(|count| u64::from(*count)).sum(),
            structure_bytes: structure_bytes(ctx, &meshes, *tlas)?,
            warnings,
            tlas,
            rig: rig(model),
            shown,
            instances,
            lights,
            emitters,
            light_setting,
            motion,
            meshes,
            culling,
            textures,
            slots: materials.slots,
            _buffers: arrays.held,
        })
    }

    /// The model without vertices, images and materials.
    pub(crate) fn rig(&self) -> &Model {
        &self.rig
    }

    /// The number of the scene of the model.
    pub(crate) fn scene_number(&self) -> usize {
        self.shown
    }

    /// The number of instances of meshes.
    pub(crate) fn instance_count(&self) -> u32 {
        self.instances.table.len() as u32
    }

    /// Everything to rasterise.
    pub(crate) fn draws(&self) -> &[Draw] {
        &self.instances.draws
    }

    /// The pass that leaves out instances that the camera does not see.
    pub(crate) fn culling(&self) -> &Culling {
        &self.culling
    }

    /// Moves nodes, lights and vertices to another pose, in the next frame. Returns false if nothing moves.
    pub(crate) fn set_pose(&mut self, pose: &Pose) -> bool {
        let is_other = self.motion.as_mut().is_some_and(|motion| motion.set_pose(pose));
        if is_other {
            self.instances.place(&self.placements(pose));
            if !self.meshes.emissive.is_empty() {
                self.emitters = self.meshes.emissive.emitters(&self.instances.table);
            }
            let scene = (&self.rig, self.shown);
            self.lights = GpuLights::new(scene, pose, &self.emitters, &self.light_setting);
            self.light.sky_probability = self.lights.sky_probability;
        }
        is_other
    }

    fn placements(&self, pose: &Pose) -> Vec<Placement> {
        self.rig.placements(self.shown, pose)
    }

    /// True if the next frame shows something elsewhere than the last one.
    pub(crate) fn moves(&self) -> bool {
        self.motion.as_ref().is_some_and(SceneMotion::moves)
    }

    /// Records what moves vertices and structures to the pose. `is_first`: there is no frame before.
    pub(crate) fn record_motion(&self, frame: &mut Frame<'_>, is_first: bool) -> lvk::Result<()> {
        let moved = (&self.rig, &self.instances);
        self.motion.as_ref().map_or(Ok(()), |motion| motion.record(frame, moved, *self.tlas, is_first))
    }

    /// Uploads what moves, and returns what leads to the scene in this step of a frame.
    pub(crate) fn constants(&self, cmd: &mut CommandBuffer, is_first: bool) -> lvk::Result<SceneConstants> {
        let slots = match self.textures.is_streaming() && !self.slots.is_empty() {
            true => cmd.upload_slice(&self.slots)?,
            false => self.constants.slots,
        };
        let constants = SceneConstants { slots, ..self.constants };
        let Some(motion) = self.motion.as_ref().filter(|_| !self.instances.table.is_empty()) else {
            return Ok(constants);
        };
        let (lights, emitters) = (&self.lights.lights, &self.emitters.triangles);
        Ok(SceneConstants {
            instances: cmd.upload_slice(&self.instances.table)?,
            rows_before: cmd
                .upload_slice(&motion.transforms_before(self.instances.transforms(), is_first))?,
            lights: if lights.is_empty() { self.constants.lights } else { cmd.upload_slice(lights)? },
            emitters: if emitters.is_empty() { self.constants.emitters } else { cmd.upload_slice(emitters)? },
            ..constants
        })
    }

    /// Memory of textures; `None` without a budget.
    pub(crate) fn texture_memory(&self) -> Option<TextureMemory> {
        self.textures.memory()
    }

    /// The buffer that shaders write the mip levels to that they want, if levels come and go.
    pub(crate) fn wanted_mips(&self) -> Option<BufferHandle> {
        self.textures.report()
    }

    /// Records that shaders have wanted no mip level so far.
    pub(crate) fn clear_wanted_mips(&self, cmd: &mut CommandBuffer) -> lvk::Result<()> {
        self.textures.clear_report(cmd)
    }

    /// Takes mip levels that a thread has loaded. Returns true if other levels are resident now.
    pub(crate) fn stream_textures(&mut self, ctx: &Context) -> Result<bool, RunError> {
        let changes = self.textures.go_on(ctx)?;
        self.update_slots(changes);
        Ok(changes)
    }

    /// Waits for what shaders have wanted, and loads it. `is_first`: nothing that they wanted before counts. Returns true if other
    /// levels are resident now.
    pub(crate) fn load_wanted_textures(&mut self, ctx: &Context, is_first: bool) -> lvk::Result<bool> {
        let changes = self.textures.load_wanted(ctx, is_first)?;
        self.update_slots(changes);
        Ok(changes)
    }

    fn update_slots(&mut self, has_changes: bool) {
        if has_changes {
            self.slots.iter_mut().for_each(|slot| self.textures.update(slot));
        }
    }

    /// How light of triangles is looked for.
    pub(crate) fn emission(&self) -> EmissionConstants {
        self.lights.emission
    }

    /// Lights and box of the scene, for the ambient term.
    pub(crate) fn ambient(&self) -> AmbientConstants {
        self.lights.ambient
    }

    /// Buffers that vertices are moved in; draws and rays read them.
    pub(crate) fn written(&self) -> Vec<BufferHandle> {
        self.motion.as_ref().map_or_else(Vec::new, SceneMotion::written)
    }

    /// A frame is recorded.
    pub(crate) fn end_frame(&mut self, is_first: bool) {
        if let Some(motion) = &mut self.motion {
            motion.end_frame(&self.instances, is_first);
        }
    }

    /// Reads the positions of vertices that morph targets or joints move, a list for each geometry.
    pub(crate) fn moved_positions(&self, ctx: &Context) -> lvk::Result<Vec<Vec<[f32; 3]>>> {
        self.motion.as_ref().map_or(Ok(Vec::new()), |motion| motion.positions(ctx))
    }
}

fn structure_bytes(ctx: &Context, meshes: &GpuMeshes, tlas: AccelStructHandle) -> lvk::Result<[u64; 2]> {
    let bytes = |handle| Ok::<_, lvk::Error>(ctx.accel_struct_info(handle)?.structure_bytes);
    Ok([meshes.structures().map(bytes).sum::<lvk::Result<u64>>()?, bytes(tlas)?])
}

fn unique(keys: &[MeshKey]) -> Vec<MeshKey> {
    let mut unique = keys.to_vec();
    unique.sort();
    unique.dedup();
    unique
}

fn light_constants(lights: &GpuLights, environment: &Environment) -> LightConstants {
    LightConstants {
        light_count: lights.lights.len() as u32,
        disc_count: lights.disc_count,
        sky_probability: lights.sky_probability,
        sky_size: [environment.sky.width, environment.sky.height],
    }
}

/// The top-level structure, with room for instances that are not shown yet.
fn tlas(ctx: &Context, instances: &SceneInstances) -> lvk::Result<Holder<AccelStructHandle>> {
    let structures = instances.structures();
    ctx.create_tlas(&TlasDesc {
        instances: &structures,
        capacity: instances.table.len().max(1) as u32,
        debug_name: "scene tlas",
        ..TlasDesc::default()
    })
}

/// Buffers while they are made.
struct Arrays<'a> {
    ctx: &'a Context,
    held: Vec<Holder<BufferHandle>>,
}

impl Arrays<'_> {
    /// Uploads elements and returns their address. Without elements there is an unused one.
    fn upload<T: bytemuck::Pod>(&mut self, name: &str, elements: &[T]) -> lvk::Result<u64> {
        let none = [T::zeroed()];
        let elements = if elements.is_empty() { &none } else { elements };
        let buffer = array(self.ctx, name, BufferUsage::STORAGE, elements)?;
        let address = buffer.address()?;
        self.held.push(buffer);
        Ok(address)
    }

    fn constants(
        &mut self,
        (meshes, instances, culling): (&GpuMeshes, &SceneInstances, &Culling),
        materials: &GpuMaterials,
        (lights, emitters): (&GpuLights, &Emitters),
        environment: &Environment,
    ) -> lvk::Result<SceneConstants> {
        let sky = environment.sky.distribution();
        Ok(SceneConstants {
            instances: self.upload("instances", &instances.table)?,
            rows_before: self.upload("instances before", &instances.transforms())?,
            geometries: self.upload("geometries", &meshes.geometries)?,
            materials: self.upload("materials", &materials.materials)?,
            slots: self.upload::<GpuTextureSlot>("texture slots", &materials.slots)?,
            lights: self.upload("lights", &lights.lights)?,
            emitters: self.upload("emitters", &emitters.triangles)?,
            sky_rows: self.upload("rows of the sky", &sky.rows)?,
            sky_columns: self.upload("columns of the sky", &sky.columns)?,
            sky: self.upload("sky", &environment.sky.texels)?,
            albedos: self.upload("albedos", &albedo_table())?,
            culling: culling.constants()?,
        })
    }
}
