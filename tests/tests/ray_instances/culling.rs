//! Instances that the culling helper chooses before an update: rays of the camera hit the same as without culling.

use lvk::glam::camera::rh::{proj::vulkan, view};
use lvk::glam::{Affine3A, Quat, Vec3};
use lvk::{BuildFlags, BuildMode, Context, InstanceCulling, Result, TlasInstance};
use lvk_tests::device;
use lvk_tests::hit_comparison::HitComparison;
use lvk_tests::meshes::Mesh;
use lvk_tests::random::Random;
use lvk_tests::ray_scene::{GpuScene, Layout, Part, Placed, RayScene, instances};
use lvk_tests::ray_tracer::{HitRecord, How, MISSED, Method, RayTracer};
use lvk_tests::rays::Ray;
use lvk_tests::reference::{Answer, HitIds, Reference};

const NEAR: f32 = 0.5;
const FAR: f32 = 30.0;
const FOV: f32 = 0.9;

/// Models all over a place of 60 in size, of all sizes.
fn scene() -> RayScene {
    let mut random = Random::new(121);
    let mut place = |index: u32| {
        let turn = Quat::from_axis_angle(random.direction(), random.between(0.0, 6.0));
        let scale = random.point(Vec3::splat(0.2), Vec3::splat(2.5));
        let to = random.point(Vec3::splat(-30.0), Vec3::splat(30.0));
        let transform = Affine3A::from_scale_rotation_translation(scale, turn, to);
        Placed { custom_index: index, ..Placed::new(index as usize % 3, transform) }
    };
    let models = [Mesh::torus(5), Mesh::sphere(4), Mesh::cube_grid(2)];
    let models = models.map(|mesh| vec![Part::new(mesh, Layout::Indexed16)]).to_vec();
    RayScene { models, placed: (0..600).map(&mut place).collect() }
}

/// Position and direction of the camera.
#[derive(Clone, Copy)]
struct View {
    eye: Vec3,
    forward: Vec3,
}

impl View {
    fn culling(&self) -> InstanceCulling {
        let view = view::look_to_mat4(self.eye, self.forward, Vec3::Y);
        let projection = vulkan::perspective(FOV, 1.0, NEAR, FAR);
        InstanceCulling::from_view_projection(self.eye, (projection * view).to_cols_array_2d())
    }

    /// Rays through the pixels of a square image, from the near to the far plane.
    fn rays(&self, side: u32) -> Vec<Ray> {
        let right = self.forward.cross(Vec3::Y).normalize();
        let up = right.cross(self.forward);
        let half = (FOV * 0.5).tan();
        let place = |pixel: u32| ((pixel as f32 + 0.5) / side as f32 * 2.0 - 1.0) * half;
        let direction = |index: u32| self.forward + right * place(index % side) - up * place(index / side);
        let ray = |index| Ray { t_min: NEAR, t_max: FAR, ..Ray::new(self.eye, direction(index)) };
        (0..side * side).map(ray).collect()
    }
}

fn views() -> [View; 4] {
    let view =
        |eye: [f32; 3], forward: [f32; 3]| View { eye: eye.into(), forward: Vec3::from(forward).normalize() };
    [
        view([0.0, 0.0, 0.0], [1.0, 0.2, 0.3]),
        view([-30.0, 5.0, -30.0], [1.0, -0.1, 1.0]),
        view([12.0, -22.0, 7.0], [-0.4, 0.8, 0.1]),
        view([25.0, 0.0, 0.0], [-1.0, 0.0, 0.0]),
    ]
}

/// AABBs of the models in object space.
fn instance_bounds(scene: &RayScene) -> Vec<(Vec3, Vec3)> {
    let of_model = |parts: &Vec<Part>| {
        let points = parts[0].mesh.positions.iter().copied().map(Vec3::from);
        points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
    };
    scene.models.iter().map(of_model).collect()
}

/// The instances that are kept. Their custom indices are their places among all.
fn expected_instances(
    scene: &RayScene,
    all: &[TlasInstance],
    culling: &InstanceCulling,
) -> Vec<TlasInstance> {
    let boxes = instance_bounds(scene);
    let of_instances = scene.placed.iter().zip(all);
    let is_kept = |(placed, instance): &(&Placed, &TlasInstance)| {
        let (low, high) = boxes[placed.model];
        culling.keeps_instance(low, high, &instance.transform)
    };
    of_instances.filter(is_kept).map(|(_, instance)| *instance).collect()
}

/// Both answer places in the list of all instances.
fn agree(what: &str, rays: &[Ray], mut records: Vec<HitRecord>, answer: impl Fn(&Ray) -> Answer) {
    for record in records.iter_mut().filter(|record| record.kind != MISSED) {
        record.instance = record.custom_index;
    }
    HitComparison::of_triangles(rays, &records, answer).assert(what);
}

struct Stage {
    ctx: Context,
    scene: RayScene,
    gpu: GpuScene,
    reference: Reference,
    tracers: Vec<(Method, RayTracer)>,
}

impl Stage {
    fn new(ctx: &Context) -> Result<Self> {
        let scene = scene();
        let capacity = scene.placed.len() as u32;
        let empty = RayScene { placed: Vec::new(), ..scene.clone() };
        let gpu = empty.upload_with(ctx, BuildFlags::default(), BuildFlags::FAST_BUILD, capacity)?;
        let tracer = |method| Ok((method, RayTracer::new(ctx, method)?));
        let tracers: Result<_> = Method::available(ctx).into_iter().map(tracer).collect();
        let reference = scene.reference();
        Ok(Self { ctx: ctx.clone(), scene, gpu, reference, tracers: tracers? })
    }

    /// Shows what is kept; answers how many that are.
    fn update_tlas(&self, culling: &InstanceCulling) -> Result<Vec<u32>> {
        let all = instances(&self.scene.placed, &self.gpu.models);
        let kept = expected_instances(&self.scene, &all, culling);
        let mut cmd = self.ctx.acquire_command_buffer()?;
        cmd.update_tlas(*self.gpu.tlas, &kept, BuildMode::Auto { max_refits: 8 })?;
        self.ctx.submit(cmd)?;
        Ok(kept.iter().map(|instance| instance.custom_index).collect())
    }

    fn check(&self, what: &str, rays: &[Ray], is_shown: impl Fn(&HitIds) -> bool) -> Result<()> {
        for (method, tracer) in &self.tracers {
            let records = tracer.trace(&self.gpu.tlas, rays, How::default())?;
            agree(&format!("{what} by {method:?}"), rays, records, |ray| {
                self.reference.closest_where(ray, 0xff, |hit| is_shown(&hit.ids))
            });
        }
        Ok(())
    }
}

#[test]
fn rays_of_the_camera_see_what_they_would_see_of_all() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let stage = Stage::new(&ctx)?;
    for view in views() {
        let kept = stage.update_tlas(&view.culling())?.len();
        assert!((10..300).contains(&kept), "{kept} of 600");
        stage.check(&format!("{kept} kept"), &view.rays(30), |_| true)?;
    }
    Ok(())
}

/// A margin lets in what is beside the frustum, so that rays may start a little outside of it.
#[test]
fn a_margin_keeps_what_rays_beside_the_frustum_meet() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let stage = Stage::new(&ctx)?;
    for view in views() {
        let exact = stage.update_tlas(&view.culling())?.len();
        let kept = stage.update_tlas(&InstanceCulling { frustum_margin: 6.0, ..view.culling() })?.len();
        assert!(exact < kept && kept < 600, "{exact} and {kept}");
        let beside = view.forward.cross(Vec3::Y).normalize() * 5.0;
        let moved = View { eye: view.eye + beside, ..view };
        stage.check(&format!("{kept} kept, beside"), &moved.rays(24), |_| true)?;
    }
    Ok(())
}

/// Only instances that look too small are culled.
#[test]
fn only_small_instances_are_culled() -> Result<()> {
    let Some(ctx) = device() else { return Ok(()) };
    let stage = Stage::new(&ctx)?;
    for view in views() {
        let all = stage.update_tlas(&view.culling())?;
        let large = stage.update_tlas(&InstanceCulling { min_angle: 0.2, ..view.culling() })?;
        assert!(large.len() < all.len() && large.iter().all(|index| all.contains(index)));
        let what = format!("{} of {} are large", large.len(), all.len());
        stage.check(&what, &view.rays(24), |ids| large.contains(&ids.instance))?;
    }
    Ok(())
}
