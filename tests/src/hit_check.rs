//! Whether a scene on the GPU is hit as the reference says, by every method the device has.

use lvk::{AccelStructHandle, Context, Holder, Result};

use crate::hit_comparison::HitComparison;
use crate::ray_scene::RayScene;
use crate::ray_tracer::{CULL_NO_OPAQUE, CULL_OPAQUE, HitRecord, How, MISSED, Method, NO_OPAQUE, RayTracer};
use crate::rays::{Ray, random_rays};
use crate::reference::{Answer, Reference};

/// Relative to the distance, or to 1 where that is larger.
const DISTANCE: f32 = 1e-5;

/// Flags that exclude [`OPAQUE`](crate::ray_tracer::OPAQUE), which a module that takes all triangles for opaque adds.
const NOT_WITH_OPAQUE: u32 = NO_OPAQUE | CULL_OPAQUE | CULL_NO_OPAQUE;

/// The pipelines of every method.
pub struct HitCheck {
    tracers: Vec<(Method, RayTracer)>,
    /// Where all triangles may be taken for opaque, unless the ray says otherwise.
    opaque: Option<RayTracer>,
}

impl HitCheck {
    /// Hits of triangles count as the geometry and the ray say. Nothing is looked through, so a module that takes all of them
    /// for opaque has to find the same.
    pub fn new(ctx: &Context) -> Result<Self> {
        let opaque =
            ctx.capabilities().ray_query.then(|| RayTracer::for_opaque_triangles(ctx)).transpose()?;
        Ok(Self { opaque, ..Self::with(ctx, RayTracer::new)? })
    }

    /// Looks through triangles with odd numbers, where they are not opaque.
    pub fn with_even_primitives(ctx: &Context) -> Result<Self> {
        Self::with(ctx, RayTracer::with_even_primitives)
    }

    /// Traces with what `make` answers for every method.
    pub fn with(ctx: &Context, make: impl Fn(&Context, Method) -> Result<RayTracer>) -> Result<Self> {
        let tracer = |method| Ok((method, make(ctx, method)?));
        let tracers = Method::available(ctx).into_iter().map(tracer).collect::<Result<_>>()?;
        Ok(Self { tracers, opaque: None })
    }

    /// The pipelines.
    pub fn tracers(&self) -> impl Iterator<Item = (Method, &RayTracer)> {
        self.tracers.iter().map(|(method, tracer)| (*method, tracer))
    }

    /// The pipeline that takes all triangles for opaque, if rays with such flags have to hit the same by it: none for checks
    /// that look through triangles or meet other shapes.
    pub fn opaque_tracer(&self, flags: u32) -> Option<&RayTracer> {
        self.opaque.as_ref().filter(|_| flags & NOT_WITH_OPAQUE == 0)
    }

    /// Traces rays through and around the scene, and compares closest hits.
    ///
    /// # Panics
    /// Where they differ.
    pub fn scene(&self, what: &str, tlas: &Holder<AccelStructHandle>, scene: &RayScene) -> Result<()> {
        let reference = scene.reference();
        let rays = rays_for(&reference);
        self.closest(what, tlas, &rays, How::default(), |ray| reference.closest(ray, 0xff))
    }

    /// Compares closest hits with what `answer` says of each ray.
    ///
    /// # Panics
    /// Where they differ.
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

/// Rays through and around everything.
pub fn rays_for(reference: &Reference) -> Vec<Ray> {
    let (low, high) = reference.bounds();
    random_rays(61, 1_200, low.as_vec3(), high.as_vec3())
}

/// Compares hits of the same rays in two structures that are to be the same: ids, and distances within 1e-5 relative.
/// Where the reference is in doubt (at edges) they may differ; answers how many do.
///
/// # Panics
/// Where they differ although there is no doubt.
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
