//! Checks of closest hits against the reference, by every method of the device.

use lvk::{AccelStructHandle, Context, Holder, Result};

use crate::hit_comparison::HitComparison;
use crate::ray_scene::RayScene;
use crate::ray_tracer::{CULL_NO_OPAQUE, CULL_OPAQUE, HitRecord, How, MISSED, Method, NO_OPAQUE, RayTracer};
use crate::rays::{Ray, random_rays};
use crate::reference::{Answer, Reference};

/// Tolerance of distances, relative to the distance, or absolute below 1.
const DISTANCE: f32 = 1e-5;

/// Flags that exclude [`OPAQUE`](crate::ray_tracer::OPAQUE), which a module of opaque triangles adds.
const NOT_WITH_OPAQUE: u32 = NO_OPAQUE | CULL_OPAQUE | CULL_NO_OPAQUE;

/// Pipelines of every method.
pub struct HitCheck {
    tracers: Vec<(Method, RayTracer)>,
    /// Tracer of a module that treats all triangles as opaque.
    opaque: Option<RayTracer>,
}

impl HitCheck {
    /// Creates the pipelines of the usual shaders: opacity is that of geometry and ray. No shader ignores a hit, so a
    /// module that treats all triangles as opaque must find the same hits.
    pub fn new(ctx: &Context) -> Result<Self> {
        let opaque =
            ctx.capabilities().ray_query.then(|| RayTracer::for_opaque_triangles(ctx)).transpose()?;
        Ok(Self { opaque, ..Self::with_tracers(ctx, RayTracer::new)? })
    }

    /// Creates pipelines that ignore triangles with odd numbers, unless they are opaque.
    pub fn with_even_primitives(ctx: &Context) -> Result<Self> {
        Self::with_tracers(ctx, RayTracer::with_even_primitives)
    }

    /// Creates pipelines by `make`, for every method.
    pub fn with_tracers(ctx: &Context, make: impl Fn(&Context, Method) -> Result<RayTracer>) -> Result<Self> {
        let tracer = |method| Ok((method, make(ctx, method)?));
        let tracers = Method::available(ctx).into_iter().map(tracer).collect::<Result<_>>()?;
        Ok(Self { tracers, opaque: None })
    }

    /// Returns the pipelines.
    pub fn tracers(&self) -> impl Iterator<Item = (Method, &RayTracer)> {
        self.tracers.iter().map(|(method, tracer)| (*method, tracer))
    }

    /// Returns the pipeline that treats all triangles as opaque, if rays with such flags must have the same hits by
    /// it. There is none for checks that ignore triangles or hit other shapes.
    pub fn opaque_tracer(&self, flags: u32) -> Option<&RayTracer> {
        self.opaque.as_ref().filter(|_| flags & NOT_WITH_OPAQUE == 0)
    }

    /// Traces rays through and around the scene, and compares closest hits.
    ///
    /// # Panics
    /// When they differ.
    pub fn scene(&self, what: &str, tlas: &Holder<AccelStructHandle>, scene: &RayScene) -> Result<()> {
        let reference = scene.reference();
        let rays = rays_for(&reference);
        self.closest(what, tlas, &rays, How::default(), |ray| reference.closest(ray, 0xff))
    }

    /// Compares closest hits with `answer` for each ray.
    ///
    /// # Panics
    /// When they differ.
    pub fn closest(
        &self,
        what: &str,
        tlas: &Holder<AccelStructHandle>,
        rays: &[Ray],
        how: How,
        answer: impl Fn(&Ray) -> Answer,
    ) -> Result<()> {
        for (method, tracer) in self.tracers() {
            let records = tracer.trace(tlas, rays, how)?;
            HitComparison::of_triangles(rays, &records, &answer).assert(&format!("{what}, by {method:?}"));
        }
        if let Some(tracer) = self.opaque_tracer(how.flags) {
            let records = tracer.trace(tlas, rays, how)?;
            HitComparison::of_triangles(rays, &records, &answer)
                .assert(&format!("{what}, all taken for opaque"));
        }
        Ok(())
    }
}

/// Returns rays through and around the whole scene.
pub fn rays_for(reference: &Reference) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(61, 1_200, low.as_vec3(), high.as_vec3())
}

/// Compares hits of the same rays in two acceleration structures of one scene: ids, and distances within 1e-5
/// relative. They may differ where the reference is uncertain (at edges). Returns the number of such differences.
///
/// # Panics
/// When they differ and the reference is certain.
pub fn same_hits(
    what: &str,
    rays: &[Ray],
    (one, other): (&[HitRecord], &[HitRecord]),
    reference: &Reference,
) -> usize {
    assert_eq!((one.len(), other.len()), (rays.len(), rays.len()));
    let mut at_edges = 0;
    for (ray, (one, other)) in rays.iter().zip(one.iter().zip(other)) {
        if !same_hit(one, other) {
            let answer = reference.closest(ray, 0xff);
            assert!(!answer.is_certain, "{what}: {one:?} or {other:?}, must be {answer:?}, {ray:?}");
            at_edges += 1;
        }
    }
    let hits = one.iter().filter(|record| record.kind != MISSED).count();
    eprintln!("{what}: {} rays, {hits} hits, {at_edges} differ at edges", rays.len());
    assert!(hits * 20 >= rays.len(), "{what}: only {hits} hits, which tests nothing");
    at_edges
}

fn same_hit(one: &HitRecord, other: &HitRecord) -> bool {
    let ids = |hit: &HitRecord| (hit.kind, hit.instance, hit.custom_index, hit.geometry, hit.primitive);
    ids(one) == ids(other) && (one.t - other.t).abs() <= DISTANCE * one.t.abs().max(1.0)
}
