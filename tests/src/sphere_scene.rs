//! Spheres in AABBs, which `sphere.rint.glsl` and `sphere_query.comp.glsl` intersect.

use lvk::glam::Vec3;
use lvk::{
    Aabbs, AccelStructHandle, BlasGeometry, BufferDesc, BufferHandle, BufferUsage, Context, GeometryFlags,
    HitGroup, Holder, Result, ShaderRecord, ShaderStage,
};

use crate::hit_check::HitCheck;
use crate::hit_comparison::HitComparison;
use crate::ray_scene::Placed;
use crate::ray_tracer::{HitRecord, How, Method, RayTracer, shader, shader_with};
use crate::rays::Ray;
use crate::reference::{HitIds, Sphere};

/// Radius in object space and tag of each hit group of spheres; an instance's hit-group offset chooses one.
pub const GROUPS: [(f32, u32); 2] = [(0.9, 17), (0.5, 99)];

/// Number of geometries of a model.
const GEOMETRIES: u32 = 2;

/// A model of two geometries of AABBs with a sphere in each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SphereModel {
    /// AABBs of a geometry.
    pub count: u32,
    /// Step between AABBs of the list, cyclic over the positions; 1 gives neighbours. It has no common divisor with
    /// `count`.
    pub step: u32,
}

impl SphereModel {
    /// Returns a model whose list has neighbours after each other.
    pub fn new(count: u32) -> Self {
        Self { count, step: 1 }
    }

    /// Uploads the AABBs and returns their buffers. The second list has an offset and a stride.
    pub fn aabb_geometries(&self, ctx: &Context) -> Result<(Vec<Holder<BufferHandle>>, Vec<BlasGeometry>)> {
        let mut buffers = Vec::new();
        let mut geometries = Vec::new();
        for (geometry, offset, stride) in [(0, 0, 0), (1, 16, 32)] {
            let mut floats = vec![f32::NAN; offset as usize / 4];
            for center in (0..self.count).map(|primitive| self.center(geometry, primitive)) {
                floats.extend([center - 1.0, center + 1.0].iter().flat_map(Vec3::to_array));
                floats.extend(vec![f32::NAN; if stride == 0 { 0 } else { 2 }]);
            }
            let data = Some(bytemuck::cast_slice(&floats));
            let usage = BufferUsage::ACCEL_INPUT;
            let buffer = ctx.create_buffer(&BufferDesc { data, usage, ..Default::default() })?;
            let (count, flags) = (self.count, GeometryFlags::OPAQUE);
            geometries.push(BlasGeometry::Aabbs(Aabbs { buffer: *buffer, offset, stride, count, flags }));
            buffers.push(buffer);
        }
        Ok((buffers, geometries))
    }

    /// Returns the spheres of instances of the model, for the reference.
    pub fn spheres(&self, placed: &[Placed]) -> Vec<Sphere> {
        let mut spheres = Vec::new();
        for (instance, placed) in (0..).zip(placed) {
            let scale = f64::from(placed.transform.matrix3.x_axis.length());
            let radius = f64::from(GROUPS[placed.hit_group_offset as usize].0) * scale;
            for index in 0..GEOMETRIES * self.count {
                let (geometry, primitive) = (index / self.count, index % self.count);
                let center = placed.transform.transform_point3(self.center(geometry, primitive)).as_dvec3();
                let ids = HitIds { instance, custom_index: placed.custom_index, geometry, primitive };
                spheres.push(Sphere { center, radius, ids });
            }
        }
        spheres
    }

    /// Creates a tracer of spheres.
    pub fn tracer(&self, ctx: &Context, method: Method) -> Result<RayTracer> {
        let numbers = [self.step, self.count].map(|number| number.to_string());
        let defines = [("SPHERE_STEP", &numbers[0][..]), ("SPHERE_COUNT", &numbers[1][..])];
        match method {
            Method::Pipeline => sphere_pipeline(ctx, &defines),
            Method::Query => sphere_query(ctx, &defines),
        }
    }

    /// Traces rays through a TLAS of this model by each method, asserts that their hits equal the reference, and calls
    /// `check` with their records.
    pub fn check_hits(
        &self,
        ctx: &Context,
        tlas: &Holder<AccelStructHandle>,
        placed: &[Placed],
        rays: &[Ray],
        what: &str,
        check: impl Fn(&[HitRecord]),
    ) -> Result<()> {
        let expected = self.spheres(placed);
        for (method, tracer) in HitCheck::with_tracers(ctx, |ctx, method| self.tracer(ctx, method))?.tracers()
        {
            let records = tracer.trace(tlas, rays, How::default())?;
            HitComparison::of_shapes(rays, &records, |ray| Sphere::closest(&expected, ray))
                .assert(&format!("{what} by {method:?}"));
            check(&records);
        }
        Ok(())
    }

    /// Returns the centre of a sphere in object space, as the shaders compute it.
    fn center(&self, geometry: u32, primitive: u32) -> Vec3 {
        let place = primitive * self.step % self.count;
        Vec3::new((place % 3) as f32, (place / 3) as f32, geometry as f32) * 2.0
    }
}

fn sphere_pipeline(ctx: &Context, defines: &[(&str, &str)]) -> Result<RayTracer> {
    let ray_gen = shader(ctx, ShaderStage::RayGen, include_str!("../shaders/closest.rgen.glsl"))?;
    let miss = shader(ctx, ShaderStage::Miss, include_str!("../shaders/record.rmiss.glsl"))?;
    let hit = shader(ctx, ShaderStage::ClosestHit, include_str!("../shaders/sphere.rchit.glsl"))?;
    let text = include_str!("../shaders/sphere.rint.glsl");
    let sphere = shader_with(ctx, ShaderStage::Intersection, text, defines)?;
    let records = GROUPS.map(|(radius, tag)| [radius.to_ne_bytes(), tag.to_ne_bytes()].concat());
    let groups = records.each_ref().map(|record| HitGroup {
        closest_hit: Some(*hit),
        intersection: Some(*sphere),
        record: ShaderRecord::from_bytes(record),
        ..Default::default()
    });
    RayTracer::from_groups(ctx, *ray_gen, *miss, &groups)
}

fn sphere_query(ctx: &Context, defines: &[(&str, &str)]) -> Result<RayTracer> {
    let text = include_str!("../shaders/sphere_query.comp.glsl");
    RayTracer::from_query_text(ctx, text, defines)
}
